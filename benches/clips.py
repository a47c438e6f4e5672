#!/usr/bin/env python3
"""Attention on video clips with masks, clip by clip: is it right, and does it hold still?

    pip install opencv-python-headless numpy
    python benches/clips.py target/release/salient_stereo FOLDER… [--readme README.md]

A FOLDER is in DAVIS's published layout, or holds clips: `CLIP/frames` with `CLIP/gt`, labels of the 24 MSRC classes
(Chen and Corso, "Propagating multi-class pixel labels throughout video frames", 2010; things count, sky, ground and
trees do not), or `CLIP/rgb` with `CLIP/mask/01`. Clips are laid out as DAVIS in a folder that is removed afterwards;
masks take the size of the frames. Prints a Markdown table; with --readme it goes between the lines
`<!-- clips: begin … -->` and `<!-- clips: end -->` of that file.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

from readme import splice

# Cow, horse, sheep, aeroplane, face, car, bicycle, flower, sign, bird, book, chair, cat, dog, body, boat.
THINGS = [4, 5, 6, 9, 11, 12, 13, 14, 15, 16, 17, 18, 20, 21, 22, 23]
METHODS = ["scene", "paper", "spectral_residual", "centre"]
IMAGES, MASKS = "JPEGImages/480p", "Annotations/480p"


def images_of(folder):
    return sorted(path for path in folder.iterdir() if path.suffix in (".png", ".jpg"))


def lay_out(clip, root):
    """A clip as a sequence of DAVIS under `root`; False when it is none."""
    if (clip / "frames").is_dir() and (clip / "gt").is_dir():
        frames, labels, things = images_of(clip / "frames"), images_of(clip / "gt"), THINGS
    elif (clip / "rgb").is_dir() and (clip / "mask" / "01").is_dir():
        frames, labels, things = images_of(clip / "rgb"), images_of(clip / "mask" / "01"), range(128, 256)
    else:
        return False
    if len(frames) != len(labels):
        sys.exit(f"{clip}: {len(frames)} frames, but {len(labels)} masks")
    for folder in (IMAGES, MASKS):
        (root / folder / clip.name).mkdir(parents=True)
    for number, (frame, label) in enumerate(zip(frames, labels)):
        image, label = cv2.imread(str(frame)), cv2.imread(str(label), cv2.IMREAD_GRAYSCALE)
        mask = cv2.resize(255 * np.isin(label, things).astype(np.uint8), image.shape[1::-1],
                          interpolation=cv2.INTER_NEAREST)
        cv2.imwrite(str(root / IMAGES / clip.name / f"{number:05}.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, 100])
        cv2.imwrite(str(root / MASKS / clip.name / f"{number:05}.png"), mask)
    return True


def measured(tool, root, clip, work):
    """Figures of each method on one clip, and its number of frames."""
    out = work / "out.json"
    command = [tool, "evaluate", "--dataset", "davis", root, "--scene", clip, "--work", work / "parts", "--json", out]
    for method in METHODS:
        command += ["--method", method]
    done = subprocess.run([str(word) for word in command], stdout=subprocess.DEVNULL, check=False)
    if done.returncode != 0:
        sys.exit(f"{tool} evaluate ended with {done.returncode} on {clip}")
    results = json.loads(out.read_text())["results"]
    return {result["method"]: result["figures"] for result in results}, results[0]["frames"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tool", help="salient_stereo executable")
    parser.add_argument("folders", nargs="+", type=Path, help="DAVIS, or a folder of clips")
    parser.add_argument("--readme", help="write the table between the clips' markers of this file")
    args = parser.parse_args()
    lines = ["| clip | frames | max-F | paper's fusion | spectral residual | centre | F1 | warped IoU | truth's own |",
             "|---|---|---|---|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as work:
        work = Path(work)
        clips = []
        for number, folder in enumerate(args.folders):
            root = folder
            if not (folder / "JPEGImages").is_dir():
                root = work / str(number)
                skipped = [clip.name for clip in sorted(folder.iterdir()) if clip.is_dir() and not lay_out(clip, root)]
                if skipped:
                    print(f"{folder}: no clip in {', '.join(skipped)}", file=sys.stderr)
            if not (root / IMAGES).is_dir():
                sys.exit(f"{folder}: neither DAVIS nor clips")
            clips += [(root, sequence.name) for sequence in sorted((root / IMAGES).iterdir())]
        for number, (root, clip) in enumerate(clips):
            figures, frames = measured(args.tool, root, clip, work / f"measured{number}")
            maps = " | ".join(f"{figures[method]['map']['max_f']:.3f}" for method in METHODS)
            ours = figures["scene"]
            video = ours["video"]
            lines.append(f"| {clip} | {frames} | {maps} | {ours['salient']['f1']:.3f} "
                         f"| {video['warped_iou']:.3f} | {video['true_warped_iou']:.3f} |")
    text = "\n".join(lines) + "\n"
    print(text)
    if args.readme:
        splice(args.readme, "clips", text)


if __name__ == "__main__":
    main()
