#!/usr/bin/env bash
# Tries the README's two commands on bare machines: test/bare_machine.sh [RELEASE ...], Debian's bookworm and trixie where none is named.
#
# Each is a root file system made by debootstrap with python3, python3-venv, make and git and nothing else, so no compiler and no browser.
# A clone of this checkout's HEAD runs `make run`, then `make test`; tests that need what is not there are skipped and named at the end.
# Needs root and debootstrap. Settings of pip and certificates of this machine are taken along. TARGETS="run" tries one command only;
# ROOTS names a folder where file systems are kept and found again; they are removed where it is not set.
set -euo pipefail
repository=$(cd "$(dirname "$0")/.." && pwd)
kept=${ROOTS:-}
roots=${kept:-$(mktemp -d)}
mirror=${MIRROR:-http://deb.debian.org/debian}
packages=python3,python3-venv,make,git,ca-certificates
mounted=()

leave() {
    for place in "${mounted[@]}"; do umount --lazy "$place"; done
    [ -n "$kept" ] || rm -rf "$roots"
}
trap leave EXIT

[ $# -gt 0 ] || set -- bookworm trixie
for release in "$@"; do
    root=$roots/$release
    [ -x "$root/usr/bin/make" ] || debootstrap --variant=minbase --include="$packages" "$release" "$root" "$mirror" > "$roots/$release.log"
    cp --remove-destination /etc/resolv.conf "$root/etc/resolv.conf"
    if [ -f /etc/pip.conf ]; then cp /etc/pip.conf "$root/etc/pip.conf"; fi
    cp -r /etc/ssl/certs/. "$root/etc/ssl/certs/"
    for place in proc dev dev/shm; do
        mount --bind "/$place" "$root/$place"
        mounted=("$root/$place" "${mounted[@]}")
    done
    rm -rf "$root/srv/clone"
    git clone --quiet "$repository" "$root/srv/clone"
    for target in ${TARGETS:-run test}; do
        echo "== $release: make $target"
        env --ignore-environment HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 TERM=dumb $(env | grep -E '^(PIP_|SSL_CERT|REQUESTS_CA)' | grep -v PIP_FIND_LINKS) \
            chroot "$root" make -C /srv/clone "$target"
    done
done
