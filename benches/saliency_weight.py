#!/usr/bin/env python3
"""Does weighting the data term by saliency pay (eq. 6, `stereo.saliency_weight`)?

    python benches/saliency_weight.py target/release/salient_stereo KITTI_FOLDER [--readme README.md]

Runs `evaluate` on KITTI 2012 in the region of interest of mode `scene`, once per weight, and prints a Markdown table:
all non-occluded pixels that were measured, and the near ones, whose true disparity is 32 px and more. With --readme
the table goes between the lines `<!-- weight: begin … -->` and `<!-- weight: end -->` of that file.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from readme import splice

WEIGHTS = (0, 0.25, 0.5, 1)
NEAR_PX = 32


def measured(tool, folder, weight, work):
    """Errors in the region of interest: everywhere, and by range of true disparity."""
    out = Path(work) / f"{weight}.json"
    done = subprocess.run(
        [tool, "evaluate", "--dataset", "kitti2012", folder, "--method", "scene",
         "--set", f"stereo.saliency_weight={weight}", "--json", str(out)],
        stdout=subprocess.DEVNULL)
    # 3: some scene could not be read, and is named on stderr.
    if done.returncode not in (0, 3):
        sys.exit(f"{tool} evaluate ended with {done.returncode}")
    (result,) = json.loads(out.read_text())["results"]
    return result["figures"]["scores"]["disparity_in_roi"], result["figures"]["errors"]


def near(ranges):
    """Means over the ranges from `NEAR_PX` on."""
    ranges = [r for r in ranges if r["from_px"] >= NEAR_PX and r["pixels"]]
    # `pixels` counts the measured ones.
    pixels = sum(r["pixels"] for r in ranges)
    if not pixels:
        return {"epe_px": float("nan"), "d1": float("nan")}
    return {key: sum(r[key] * r["pixels"] for r in ranges) / pixels for key in ("epe_px", "d1")}


def table(tool, folder):
    lines = ["| weight | EPE px | D1 % | dense % | near: EPE px | near: D1 % |", "|---|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as work:
        for weight in WEIGHTS:
            every, ranges = measured(tool, folder, weight, work)
            close = near(ranges)
            lines.append(f"| {weight} | {every['epe_px']:.3f} | {100 * every['d1']:.2f} | {100 * every['density']:.1f} "
                         f"| {close['epe_px']:.3f} | {100 * close['d1']:.2f} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tool", help="salient_stereo executable")
    parser.add_argument("folder", help="KITTI 2012 folder")
    parser.add_argument("--readme", help="write the table between the weight's markers of this file")
    args = parser.parse_args()
    text = table(args.tool, args.folder)
    print(text)
    if args.readme:
        splice(args.readme, "weight", text)


if __name__ == "__main__":
    main()
