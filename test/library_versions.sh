#!/usr/bin/env bash
# Compares rooms made with the oldest and the newest numpy and scipy that requirements.txt allows: test/library_versions.sh [ROOM ...],
# bathroom and bedroom where none is named (light that is cached, and that is traced).
#
# Each has an environment of its own, of OLDEST_PYTHON (python3.11) and NEWEST_PYTHON (python3.13), and compiles its kernels anew: some
# minutes.  What the rooms publish is compared by digests (test/helpers/golden_rooms.py); topics that differ are told, and the status is 1.
set -euo pipefail
repository=$(cd "$(dirname "$0")/.." && pwd)
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
[ $# -gt 0 ] || set -- bathroom bedroom
git clone --quiet "$repository" "$place/clone"
cd "$place/clone"

digests() { # digests NAME PYTHON REQUIREMENT ...
    "$2" -m venv "$place/$1"
    "$place/$1/bin/pip" install --quiet --no-cache-dir --disable-pip-version-check "${@:3}" -r requirements.txt 'ros-jazzy-rclpy[fastrtps]' ros-jazzy-common-interfaces
    "$place/$1/bin/python" -c 'import numpy, scipy; print("numpy", numpy.__version__, "scipy", scipy.__version__)'
    PYTHONPATH=$PWD "$place/$1/bin/python" test/helpers/golden_rooms.py "${rooms[@]}" > "$place/$1.json"
    rm -rf "${place:?}/$1"
}
rooms=("$@")
oldest=()
for name in numpy scipy; do oldest+=("$name==$(sed -n "s/^$name>=//p" requirements.txt).*"); done
digests oldest "${OLDEST_PYTHON:-python3.11}" "${oldest[@]}"
digests newest "${NEWEST_PYTHON:-python3.13}"
diff "$place/oldest.json" "$place/newest.json" || { echo "what these topics of ${rooms[*]} say differs" >&2; exit 1; }
echo "all $(grep -c : "$place/oldest.json") topics of ${rooms[*]} say the same"
