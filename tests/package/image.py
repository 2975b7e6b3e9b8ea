#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The image of toolchain/oci_image.py, from nothing: image.py BUILD. It is smaller than 60 MB, the same bytes twice, has all libraries and
no shell; its digests are right. Its programs run in it as its user, on a file system that is only read: version, a run at real speed with
the health check beside it, and a replay with the same bytes as this computer's. Docker, podman and runc are not needed: the root is
unpacked and entered by unshare. skopeo and umoci, where they are, read the image, too. Skipped (77) without cpack, dpkg-deb, or the right
to a network of its own."""
import gzip
import hashlib
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
MAKER = ROOT / "toolchain/oci_image.py"
LARGEST_BYTES = 60e6
USER = 65532
NETWORK = "ip link set lo up; ip route add 224.0.0.0/4 dev lo; "


def run(*command, **how):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **how)
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout


def make(folder, build):
    """The package of a build, and its image, twice."""
    env = {**os.environ, "SOURCE_DATE_EPOCH": "1700000000"}
    run("cpack", "-G", "DEB", "-B", folder / "debs", "-D", "CPACK_COMPONENTS_ALL=runtime", cwd=build, env=env)
    deb = next((folder / "debs").glob("*.deb"))
    for name, zone, umask in (("image.tar", "UTC", 0o022), ("again.tar", "Asia/Tokyo", 0o077)):
        print(run(MAKER, folder / name, deb, env={**env, "TZ": zone}, umask=umask).splitlines()[-1])
    assert (folder / "image.tar").read_bytes() == (folder / "again.tar").read_bytes(), "two images of one package differ"


def unpack(image, root):
    """By the index, as a reader has to; the image's configuration."""
    with tarfile.open(image) as tar:
        read = lambda name: tar.extractfile(name).read()  # noqa: E731

        def blob(of):
            content = read("blobs/sha256/" + of["digest"].removeprefix("sha256:"))
            assert hashlib.sha256(content).hexdigest() == of["digest"].removeprefix("sha256:") and len(content) == of["size"]
            return content

        manifest = json.loads(blob(json.loads(read("index.json"))["manifests"][0]))
        config = json.loads(blob(manifest["config"]))
        packed = root.parent / "layer.tar.gz"
        packed.write_bytes(blob(manifest["layers"][0]))
        docker = json.loads(read("manifest.json"))[0]
        assert docker["Config"].endswith(manifest["config"]["digest"][7:]) and docker["Layers"][0].endswith(manifest["layers"][0]["digest"][7:])
    layer = gzip.decompress(packed.read_bytes())
    assert [f"sha256:{hashlib.sha256(layer).hexdigest()}"] == config["rootfs"]["diff_ids"]
    assert len(layer) < LARGEST_BYTES, f"{len(layer)} bytes"
    with tarfile.open(packed) as tar:
        assert {entry.mtime for entry in tar} == {1700000000}
        assert {(e.name, e.uid, oct(e.mode)) for e in tar if e.uid} == {("var/lib/waymark", USER, "0o750"), ("run/waymark", USER, "0o750")}
        for entry in tar:  # the one user that there is here
            entry.uid = entry.gid = 0
            tar.extract(entry, root)
    return config


def recording(folder):
    folder.mkdir()
    (folder / "recording.yaml").write_text("format: waymark-recording/1\nname: straight\nstreams: [motion.csv]\n"
                                           "vehicle: {initial_pose: {t_ns: 0, x_m: 1, y_m: 2, heading_rad: 0}}\n")
    (folder / "motion.csv").write_text("t_ns,v_mps,w_radps\n" + "".join(f"{i * 20}000000,0.5,0.01\n" for i in range(500)))
    (folder / "robot.yaml").write_text("format: waymark-config/1\nestimator: odometry\nrealtime: {lock_memory: false}\n")


def inside(root, words):
    """A command in the image: its user, no capability, nothing that can be written but what is bound."""
    return ["unshare", "--user", f"--map-user={USER}", f"--map-group={USER}", f"--root={root}", "--wd=/", *words]


def try_it(folder, root, config, build):
    program = config["config"]["Entrypoint"]
    assert config["config"]["User"] == f"{USER}:{USER}" and config["config"]["Cmd"][0] == "run"
    recording(root / "rec")
    (root / "out").mkdir(mode=0o777)
    (root / "out").chmod(0o777)
    assert "waymark 0." in run(*inside(root, [*program, "--version"]))
    for name in ("waymark-play", "waymark-web"):
        if (root / "usr/bin" / name).exists():
            run(*inside(root, [f"/usr/bin/{name}", "--help"]))
    run(*inside(root, [*program, "replay", "/rec", "--config", "/rec/robot.yaml", "--out", "/out/run"]))
    run(build / "bin/waymark", "replay", root / "rec", "--config", root / "rec/robot.yaml", "--out", folder / "here")
    assert (root / "out/run/trajectory.csv").read_bytes() == (folder / "here/trajectory.csv").read_bytes(), "other poses than here"

    check = config["config"]["Healthcheck"]["Test"][1:]
    silent = subprocess.run(inside(root, check), capture_output=True, text=True, check=False)
    assert silent.returncode == 1 and "no run sends its health" in silent.stderr, silent
    daemon = subprocess.Popen(inside(root, [*program, "run", "--config", "/rec/robot.yaml", "--recording", "/rec"]), stderr=subprocess.PIPE)
    time.sleep(1)
    healthy = subprocess.run(inside(root, check), capture_output=True, text=True, check=False)
    daemon.send_signal(getattr(signal, config["config"]["StopSignal"]))
    daemon.wait(timeout=10)
    assert healthy.returncode == 0 and "dead reckoning" in healthy.stdout, (healthy, daemon.stderr.read())
    print("in the image: version, the same poses as here, a run that its health check hears, and its silence")


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    if os.environ.get("WM_OWN_NETWORK") != "1":
        if not all(map(shutil.which, ("cpack", "dpkg-deb", "dpkg-query", "readelf"))) or subprocess.run(
                ["unshare", "-rn", "unshare", "--user", "true"], capture_output=True, check=False).returncode:
            print("skipped: no cpack, dpkg or readelf here, or no right to namespaces")
            return 77
        os.environ.update(WM_OWN_NETWORK="1")
        os.execvp("unshare", ["unshare", "-rn", "sh", "-ec", NETWORK + 'exec "$@"', "sh", sys.executable, *sys.argv])
    with tempfile.TemporaryDirectory(prefix="waymark-oci-") as name:
        folder = pathlib.Path(name)
        folder.chmod(0o755)
        root = folder / "root"
        root.mkdir(mode=0o755)
        make(folder, build)
        config = unpack(folder / "image.tar", root)
        assert not list(root.rglob("*bin/*sh")) and len(list(root.glob("var/lib/dpkg/status.d/*"))) > 5
        try_it(folder, root, config, build)
        if shutil.which("skopeo"):
            for kind in ("oci-archive", "docker-archive"):
                assert json.loads(run("skopeo", "inspect", "--config", f"{kind}:{folder}/image.tar"))["config"]["User"] == f"{USER}:{USER}"
            print("skopeo reads it, as OCI's and as Docker's archive")
    return 0


if __name__ == "__main__":
    sys.exit(main())
