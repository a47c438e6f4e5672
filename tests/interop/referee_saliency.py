#!/usr/bin/env python3
"""Scores saliency maps with pysodmetrics, and checks scores of ours against its figures.

    pip install -r tests/interop/requirements.txt
    python tests/interop/referee_saliency.py MAPS_DIR MASKS_DIR [SCORES.json]

Both folders hold gray PNGs of equal names (in subfolders as well); masks are salient above 128, as pysodmetrics takes
them, and images without a salient pixel are left out. SCORES.json is an object with `as_is` (value / 255) and `stretched` (each map
stretched to 0..1 first) as the metrics print them, and with `each`, where the same may stand for single images
by name; without it the figures are printed as a table.
Exit code 0: every number agrees to 1e-4.
"""

import argparse
import json
import sys
import warnings
from pathlib import Path

import cv2
import numpy as np
import py_sod_metrics
from py_sod_metrics.utils import EPS

TOLERANCE = 1e-4
SCALARS = ["max_f", "mean_f", "adaptive_f", "weighted_f", "s_measure", "max_e", "mean_e", "adaptive_e", "mae",
           "roi_90", "roi_95"]
CURVES = ["precision", "recall", "area"]


class Smeasure(py_sod_metrics.Smeasure):
    """Where the object's centre lies in the last row or column, two quarters are empty and their mean is NaN: they
    weigh nothing."""

    def ssim(self, pred, gt):
        return super().ssim(pred, gt) if pred.size else 0.0


class Emeasure(py_sod_metrics.Emeasure):
    """The divisor, one less than the number of pixels, is EPS for a single pixel: there it is taken as 1."""

    def step(self, pred, gt, normalize=True):
        super().step(pred, gt, normalize)
        if gt.size == 1:
            self.changeable_ems[-1] = self.changeable_ems[-1] * EPS
            self.adaptive_ems[-1] = self.adaptive_ems[-1] * EPS


def areas(values, salient):
    """Shares of the image and of the salient pixels at or above each threshold 0..255."""
    steps = (values * 255).astype(np.uint8)
    thresholds = np.arange(256)[:, None]
    area = (steps.ravel() >= thresholds).mean(axis=1)
    recall = (steps[salient] >= thresholds).sum(axis=1) / np.count_nonzero(salient)
    return area, recall


def referee(pairs, stretch):
    """The same figures as ours, by pysodmetrics; areas in plain NumPy."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        f = py_sod_metrics.Fmeasure()
    weighted, s, e, mae = py_sod_metrics.WeightedFmeasure(), Smeasure(), Emeasure(), py_sod_metrics.MAE()
    curves, holding = [], {90: [], 95: []}
    for image, mask in pairs:
        values, salient = image / 255, mask > 128
        if stretch and values.max() != values.min():
            values = (values - values.min()) / (values.max() - values.min())
        for metric in (f, weighted, s, e, mae):
            if stretch:
                metric.step(image, salient.astype(np.uint8) * 255)
            else:
                metric.step(values, salient, normalize=False)
        area, recall = areas(values, salient)
        curves.append(area)
        for percent, list_of in holding.items():
            list_of.append(area[recall >= percent / 100].min())
    f, e = f.get_results(), e.get_results()["em"]
    return {
        "images": len(pairs),
        "max_f": f["fm"]["curve"].max(), "mean_f": f["fm"]["curve"].mean(), "adaptive_f": f["fm"]["adp"],
        "weighted_f": weighted.get_results()["wfm"], "s_measure": s.get_results()["sm"],
        "max_e": e["curve"].max(), "mean_e": e["curve"].mean(), "adaptive_e": e["adp"],
        "mae": mae.get_results()["mae"],
        # Theirs run from threshold 255 down.
        "precision": f["pr"]["p"][::-1], "recall": f["pr"]["r"][::-1], "area": np.mean(curves, axis=0),
        "roi_90": np.mean(holding[90]), "roi_95": np.mean(holding[95]),
    }


def both(pairs):
    return {"as_is": referee(pairs, False), "stretched": referee(pairs, True)}


def compare(label, scores, rows):
    """One text per figure of `scores` that is not that of `rows`."""
    faults = []
    for name, row in rows.items():
        ours = scores[name]
        if ours["images"] != row["images"]:
            faults.append(f"{label}, {name}: {ours['images']} images, {row['images']} expected")
        for key in SCALARS + CURVES:
            a, b = np.asarray(ours[key], float), np.asarray(row[key], float)
            if a.shape != b.shape:
                faults.append(f"{label}, {name}.{key}: {a.size} values, {b.size} expected")
                continue
            worst = np.max(np.abs(a - b))
            # Written so that NaN is a fault.
            if not worst <= TOLERANCE:
                faults.append(f"{label}, {name}.{key}: off by {worst:.2e}" + (f" of {b}" if b.size == 1 else ""))
    return faults


def read(maps, masks):
    """Name -> map and mask; images without a salient pixel are left out."""
    pairs = {}
    for path in sorted(Path(maps).rglob("*.png")):
        name = path.relative_to(maps)
        images = [cv2.imread(str(p), cv2.IMREAD_GRAYSCALE) for p in (path, Path(masks) / name)]
        if any(image is None for image in images):
            sys.exit(f"{name}: no readable mask and map of this name")
        if images[0].shape != images[1].shape:
            sys.exit(f"{name}: the map is {images[0].shape}, the mask {images[1].shape}")
        if (images[1] > 128).any():
            pairs[str(name.with_suffix(""))] = images
    if not pairs:
        sys.exit(f"{maps}: no map whose mask has a salient pixel")
    return pairs


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("maps")
    parser.add_argument("masks")
    parser.add_argument("scores", nargs="?")
    args = parser.parse_args()
    pairs = read(args.maps, args.masks)
    rows = both(pairs.values())
    if args.scores is None:
        print(f"{len(pairs)} images\n\n| row | {' | '.join(SCALARS)} |\n|---{'|---' * len(SCALARS)}|")
        for name, row in rows.items():
            print(f"| {name} | " + " | ".join(f"{row[key]:.4f}" for key in SCALARS) + " |")
        return
    scores = json.loads(Path(args.scores).read_text())
    faults = compare("all", scores, rows)
    for name, ours in scores.get("each", {}).items():
        faults += compare(name, ours, both([pairs[name]]))
    print("\n".join(faults) if faults else f"{len(pairs)} images, all figures agree")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
