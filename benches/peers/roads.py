#!/usr/bin/env python3
"""How much of the image a region of interest must take to hold the objects of a road scene.

    pip install -r tests/interop/requirements.txt
    python benches/peers/roads.py --tool target/release/salient_stereo DATA/road_boxes.json

The file has `boxes`: left image (a path from the file's folder) -> list of [x0, y0, x1, y1] in pixels, ends excluded.
Images in the layout of KITTI 2012 are read with their frames before; any other one, whose partner has `right` for
`left` in its name, as a single pair of the camera of --focal, --centre and --baseline.

The region of a share of the image is what has the highest attention, equal values all or not at all, and never what
has none. An object is inside when 80 % of its box are (the rest is what a box holds beside its object; 50 % is
printed as well). Prints Markdown: one row per method beside two that never look at the picture, and every object
that needs more than 30 %.
"""

import argparse
import json
import subprocess
import tempfile
from collections import defaultdict
from pathlib import Path

import cv2
import numpy as np

SHARES = [0.2, 0.25, 0.3, 0.35, 0.4]
COVERS = [0.8, 0.5]
METHODS = ["scene", "paper", "spectral_residual", "frequency_tuned"]


def evaluate(tool, kind, folder, methods, work):
    """Path of the map of an image by method and name."""
    maps = work / "maps"
    command = [tool, "evaluate", "--dataset", kind, folder, "--maps", maps, "--work", work / "parts", "--json",
               work / "out.json"]
    for method in methods:
        command += ["--method", method]
    subprocess.run([str(word) for word in command], check=True)
    return lambda method, image: maps / kind / method / image[:6] / image


def as_kitti_2015(left, work, args):
    """A folder in the layout of KITTI 2015 that holds one pair."""
    root = work / "pair" / "training"
    right = left.with_name(left.name.replace("left", "right"))
    for folder, image in (("image_2", left), ("image_3", right)):
        (root / folder).mkdir(parents=True)
        (root / folder / "000000_10.png").symlink_to(image.resolve())
    (root / "calib_cam_to_cam").mkdir()
    (cx, cy), f = args.centre, args.focal
    (root / "calib_cam_to_cam" / "000000.txt").write_text("".join(
        f"P_rect_0{camera}: {f} 0 {cx} {shift} 0 {f} {cy} 0 0 0 1 0\n"
        for camera, shift in ((2, 0), (3, -f * args.baseline))))
    return root.parent


def prior(name, shape):
    """Gaussians of place alone, as the rows `centre` and `rows` of `evaluate`."""
    height, width = shape
    u = (np.arange(width) + 0.5) / width - 0.5
    v = (np.arange(height) + 0.5)[:, None] / height - 0.5
    squares = (u / 0.25) ** 2 + (v / 0.25) ** 2 if name == "centre" else (v / 0.15) ** 2 + 0 * u
    return 255 * np.exp(-0.5 * squares)


def share_needed(values, box, cover):
    """Share of the image that the region has when it just covers this part of the box, and the value there."""
    x0, y0, x1, y1 = box
    inside = np.sort(values[y0:y1, x0:x1], axis=None)[::-1]
    value = inside[int(np.ceil(cover * inside.size)) - 1]
    return ((values >= value).mean() if value > 0 else 1.0), value


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("boxes", type=Path, help="file with the boxes, in the folder that its paths start from")
    parser.add_argument("--tool", required=True, help="salient_stereo executable")
    parser.add_argument("--method", action="append", help=f"only this method (default: {', '.join(METHODS)})")
    parser.add_argument("--focal", type=float, default=721.5377, help="of single pairs, pixels (KITTI 2015)")
    parser.add_argument("--centre", type=float, nargs=2, default=[609.5593, 172.854], help="of single pairs, pixels")
    parser.add_argument("--baseline", type=float, default=0.5327, help="of single pairs, metres")
    args = parser.parse_args()
    methods = args.method or METHODS
    boxes = {image: found for image, found in json.loads(args.boxes.read_text())["boxes"].items() if found}
    needed = defaultdict(list)
    with tempfile.TemporaryDirectory() as work:
        folders = {}
        for number, (image, found) in enumerate(boxes.items()):
            left = args.boxes.parent / image
            here = Path(work) / str(number)
            if left.parent.name == "image_0":
                folder, name = left.parents[1], left.name
                if folder not in folders:
                    folders[folder] = evaluate(args.tool, "kitti2012", folder, methods, here)
                map_of = folders[folder]
            else:
                map_of = evaluate(args.tool, "kitti2015", as_kitti_2015(left, here, args), methods, here)
                name = "000000_10.png"
            maps = {method: cv2.imread(str(map_of(method, name)), cv2.IMREAD_GRAYSCALE) for method in methods}
            shape = next(iter(maps.values())).shape
            for method, values in (maps | {name: prior(name, shape) for name in ("centre", "rows")}).items():
                for box in found:
                    needed[method].append((image, box, [share_needed(values, box, cover) for cover in COVERS]))
    heads = [f"{cover:.0%} at {share:.0%}" for cover in COVERS for share in SHARES]
    print(f"| method | objects | {' | '.join(heads)} |\n|---|---{'|---' * len(heads)}|")
    for method, objects in needed.items():
        figures = [np.mean([row[2][i][0] <= share for row in objects]) for i in range(len(COVERS)) for share in SHARES]
        print(f"| {method} | {len(objects)} | {' | '.join(f'{figure:.3f}' for figure in figures)} |")
    print(f"\n| needs more than 30 % ({methods[0]}) | box | share | attention |\n|---|---|---|---|")
    for image, box, ((share, value), *_) in needed[methods[0]]:
        if share > 0.3:
            print(f"| {image} | {box} | {share:.3f} | {value / 255:.2f} |")


if __name__ == "__main__":
    main()
