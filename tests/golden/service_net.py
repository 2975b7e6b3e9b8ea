#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The unit's IP filter lets local LCM multicast through on a computer whose multicast goes out of a network interface by default.
systemd's filter looks at the source of an incoming packet: it has to be one of the unit's IPAddressAllow. In a network of its own
(else 77) the command of the unit that sees to it is carried out."""
import ipaddress
import pathlib
import re
import shlex
import socket
import subprocess
import sys

TESTS = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TESTS / "common"))
import in_a_network  # noqa: E402

UNIT = (TESTS.parent / "config/waymark.service").read_text()
GROUP, PORT = "239.255.76.67", 7667


def allowed():
    words = " ".join(re.findall(r"^IPAddressAllow=(.*)$", UNIT, re.M)).replace("localhost", "127.0.0.0/8").split()
    return [ipaddress.ip_network(word) for word in words]


def source_of_multicast():
    """A datagram to LCM's group comes back to this computer: from which address?"""
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    receiver.bind(("", PORT))
    receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + socket.inet_aton("0.0.0.0"))
    receiver.settimeout(2)
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    sender.sendto(b"pose", (GROUP, PORT))
    return ipaddress.ip_address(receiver.recvfrom(100)[1][0])


def main():
    in_a_network.begin(programs=(), multicast=False)
    for command in ("ip link add nic0 type veth peer name nic1", "ip link set nic1 up", "ip addr add 192.0.2.2/24 dev nic0", "ip link set nic0 up",
                    "ip route add default dev nic0"):
        if subprocess.run(command.split(), capture_output=True).returncode:
            in_a_network.skip(f"{command} fails here")
    before = source_of_multicast()
    print(f"by the default route a local datagram comes from {before}")
    assert not any(before in network for network in allowed()), "this computer can't show it"
    for command in re.findall(r"^ExecStartPre=\+-?(\S*ip route .*)$", UNIT, re.M):
        subprocess.run(shlex.split(command), check=True)
    after = source_of_multicast()
    print(f"with the unit's route it comes from {after}")
    assert any(after in network for network in allowed()), "the unit's IP filter drops local LCM multicast"


if __name__ == "__main__":
    sys.exit(main())
