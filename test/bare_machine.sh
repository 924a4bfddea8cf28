#!/usr/bin/env bash
# Tries the README's two commands on bare machines: test/bare_machine.sh [RELEASE ...], Debian's bookworm and trixie where none is named.
#
# Each is a root file system made by debootstrap with python3, python3-venv, make and git and nothing else, so no compiler and no browser.
# A clone of this checkout's HEAD runs `make run`, then `make test`; tests that need what is not there are skipped and named at the end.
# At the end the messages that `make run` has recorded on each are compared by their hashes: the same seed gives the same bytes, with other
# versions of Python, numpy, scipy and the C library, too.  Topics that differ are told, and the status is 1.
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
inside() { # inside ROOT COMMAND ...
    env --ignore-environment HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 TERM=dumb \
        $(env | grep -E '^(PIP_|SSL_CERT|REQUESTS_CA)' | grep -v PIP_FIND_LINKS) chroot "$@"
}
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
        inside "$root" make -C /srv/clone "$target"
    done
    for bag in "$root"/srv/clone/runs/*/; do
        [ -d "$bag" ] || continue
        inside "$root" /srv/clone/.venv/bin/python /srv/clone/test/helpers/message_hashes.py "${bag#"$root"}" > "$roots/$release.hashes"
    done
done
for release in "${@:2}"; do
    [ -s "$roots/$release.hashes" ] || continue
    if ! changed=$(diff "$roots/$1.hashes" "$roots/$release.hashes"); then
        echo "$1 and $release: messages differ: $(echo "$changed" | awk '/^</ {print $2}' | sort | uniq -c | tr -s ' \n' ' ')"
        exit 1
    fi
    echo "$1 and $release: all $(wc -l < "$roots/$1.hashes") messages are the same"
done
