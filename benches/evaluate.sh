#!/usr/bin/env bash
# Measures again everything that the README says about quality, and writes it there.
#
#   benches/evaluate.sh DATA [OPTION…]
#
# DATA holds whatever there is of the published folders, as
#   kitti2012/  kitti2015/  middlebury*/  sintel/  spring/  davis/  duts/DUTS-TR/  video_masks/
# and our own bags are always measured. OPTIONs go to `salient_stereo evaluate` (--threads 1, --set …).
# OpenCV's rows, the matcher's table and that of the clips need a Python with opencv-python-headless, numpy, mcap and mcap-ros2-support:
# set PYTHON; without it they are left out.
# Finished scenes are kept in out/evaluation: run it again after an interruption. Exit code 3: everything was
# written, and scenes that could not be read are named above.
set -euo pipefail
data=$(realpath "${1:?the folder with the data sets}")
shift
cd "$(dirname "$0")/.."
cargo build --locked --release
tool=target/release/salient_stereo

kinds=() paths=()
add() { kinds+=(--dataset "$1"); paths+=("$2"); }
[ -d "$data/kitti2012/training/disp_noc" ] && add kitti2012 "$data/kitti2012"
[ -d "$data/kitti2015/training/disp_noc_0" ] && add kitti2015 "$data/kitti2015"
compgen -G "$data/middlebury*" >/dev/null && mkdir -p out && {
    # The years lie side by side: one folder that holds them and nothing else.
    rm -rf out/middlebury && mkdir out/middlebury
    for year in "$data"/middlebury*; do ln -s "$year" out/middlebury/; done
    add middlebury out/middlebury
}
[ -d "$data/sintel/training/disparities" ] && add sintel "$data/sintel"
[ -d "$data/spring/train" ] && add spring "$data/spring"
[ -d "$data/davis/Annotations" ] && add davis "$data/davis"
[ -d "$data/duts/DUTS-TR" ] && add saliency "$data/duts/DUTS-TR"
add bag bags/street.mcap
add bag bags/tabletop.mcap

peers=()
scenes=()
clips=()
if [ -n "${PYTHON:-}" ]; then
    [ -d "$data/kitti2012/training/disp_noc" ] && scenes+=("$data/kitti2012")
    [ -d "$data/kitti2015/training/disp_noc_0" ] && scenes+=("$data/kitti2015")
    while read -r image; do scenes+=("$(dirname "$image")"); done < <(
        find -L "$data"/middlebury*/ -name mask0nocc.png -o -name groundtruth.png -o -name disp1.png -o -name '*GT.png' | sort)
    [ -d "$data/davis/Annotations" ] && clips+=("$data/davis")
    [ -d "$data/video_masks" ] && clips+=("$data/video_masks")
    mkdir -p out
fi
[ ${#clips[@]} -gt 0 ] && "$PYTHON" benches/clips.py "$tool" "${clips[@]}" --readme README.md >/dev/null
if [ ${#scenes[@]} -gt 0 ]; then
    "$PYTHON" benches/peers/stereo.py "${scenes[@]}" --tool "$tool" --readme README.md --json out/peers.json >out/peers.md
    peers=(--peers out/peers.json)
    if [ -d "$data/kitti2012/training/disp_noc" ]; then
        "$PYTHON" benches/saliency_weight.py "$tool" "$data/kitti2012" --readme README.md >/dev/null
    fi
fi

"$tool" evaluate "${kinds[@]}" "${paths[@]}" "${peers[@]}" "$@" \
    --made-by "benches/evaluate.sh DATA${*:+ $*}" \
    --markdown out/evaluation.md --csv out/evaluation.csv --json out/evaluation.json --report out/evaluation.html \
    --readme README.md
