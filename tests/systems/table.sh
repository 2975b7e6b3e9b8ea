# SPDX-License-Identifier: Apache-2.0
# Sourced: the systems that Waymark is built on, and where their packages are.
# Archives: this machine's own of Debian; Ubuntu's, and that of its ports before 26.04, as the environment names them. "-": none is known.
debian=${WM_DEBIAN_ARCHIVE:-$(awk '/^URIs/{print $2; exit}' /etc/apt/sources.list.d/debian.sources 2>/dev/null)}
debian=${debian:--} ubuntu=${WM_UBUNTU_ARCHIVE:--} ports=${WM_UBUNTU_PORTS:--}
# Name, suite, archive, components, libstdc++ that its compiler links.
table="debian-12-amd64 bookworm $debian main 12
debian-13-amd64 trixie $debian main 14
ubuntu-22.04-amd64 jammy $ubuntu main,universe 11
ubuntu-24.04-amd64 noble $ubuntu main,universe 13
ubuntu-26.04-amd64 resolute $ubuntu main,universe 15
debian-12-arm64 bookworm $debian main 12
debian-13-arm64 trixie $debian main 14
ubuntu-22.04-arm64 jammy $ports main,universe 11
ubuntu-24.04-arm64 noble $ports main,universe 13
ubuntu-26.04-arm64 resolute $ubuntu main,universe 15"
ubuntu_keys=/usr/share/keyrings/ubuntu-archive-keyring.gpg # in Debian 13's ubuntu-keyring
