#!/usr/bin/env python3
"""Scores disparity and salient masks in NumPy, and checks scores of ours against the figures.

    pip install -r tests/interop/requirements.txt
    python tests/interop/referee_stereo.py DIR [SCORES.json]

DIR holds folders with one file per frame, of equal names:

    truth/*.pfm       true disparity in pixels
    disparity/*.pfm   found disparity
    confidence/*.pfm  its confidence (may be missing)
    salient/*.png     non-zero where truly salient (may be missing)
    found/*.png       non-zero where found salient (may be missing)

What is not finite in a PFM is unknown. SCORES.json is an object with `disparity`, `filled`, `sparsification` and
`salient` as the metrics print them; without it the figures are printed. Exit code 0: every number agrees to 1e-4.
"""

import argparse
import json
import sys
from pathlib import Path

import cv2
import numpy as np

TOLERANCE = 1e-4
STEPS = 20
LEAST_PIXELS = 100


def read_pfm(path):
    with open(path, "rb") as file:
        if file.readline().strip() != b"Pf":
            sys.exit(f"{path}: not a PFM of one channel")
        width, height = map(int, file.readline().split())
        scale = float(file.readline())
        data = np.frombuffer(file.read(), "<f4" if scale < 0 else ">f4").reshape(height, width)
    return data[::-1].astype(np.float32)


def read_mask(path):
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        sys.exit(f"{path}: cannot be read as an image")
    return image != 0


def filled(disparity):
    """Every hole takes the smaller of its two row neighbours; empty rows are 0."""
    out = disparity.copy()
    for row in out:
        known = np.flatnonzero(np.isfinite(row))
        if known.size == 0:
            row[:] = 0
            continue
        holes = np.flatnonzero(~np.isfinite(row))
        after = np.searchsorted(known, holes)
        left = row[known[np.clip(after - 1, 0, known.size - 1)]]
        right = row[known[np.clip(after, 0, known.size - 1)]]
        row[holes] = np.where(after == 0, right, np.where(after == known.size, left, np.minimum(left, right)))
    return out


def disparity_score(frames):
    """Eq. 10 and the benchmarks' measures over the pixels of all (disparity, truth)."""
    found = np.concatenate([d.ravel() for d, _ in frames])
    truth = np.concatenate([t.ravel() for _, t in frames])
    known = np.isfinite(truth)
    both = known & np.isfinite(found)
    error = np.abs(found[both] - truth[both])
    score = {f"bad_{tau}": np.mean(error > tau) for tau in (1, 2, 3, 4)}
    score["epe_px"] = np.mean(error, dtype=np.float64)
    score["d1"] = np.mean((error > 3) & (error > np.float32(0.05) * np.abs(truth[both])))
    score["density"] = both.sum() / known.sum()
    score["pixels"] = int(both.sum())
    return score


def sparsification(frames):
    """Mean error that remains after 0, 5, ... 95 % of the pixels went, as a share of the frame's; mean over frames."""
    by_confidence, by_error = [], []
    for disparity, confidence, truth in frames:
        valid = np.isfinite(disparity) & np.isfinite(truth) & np.isfinite(confidence)
        error = np.abs(disparity - truth)[valid].astype(np.float64)
        if error.size < LEAST_PIXELS or error.sum() <= 0:
            continue

        def curve(order):
            return np.array([error[order][error.size * i // STEPS:].mean() for i in range(STEPS)]) / error.mean()

        by_confidence.append(curve(np.argsort(confidence[valid], kind="stable")))
        by_error.append(curve(np.argsort(-error, kind="stable")))
    if not by_error:
        return None
    by_confidence, by_error = np.mean(by_confidence, axis=0), np.mean(by_error, axis=0)
    return {"by_confidence": by_confidence, "by_error": by_error, "ause": np.mean(by_confidence - by_error)}


def pixel_score(frames):
    """Eq. 7-9 over the pixels of all (found, salient)."""
    found = np.concatenate([f.ravel() for f, _ in frames])
    salient = np.concatenate([s.ravel() for _, s in frames])
    tp, tn = np.sum(found & salient), np.sum(~found & ~salient)
    fp, fn = np.sum(found & ~salient), np.sum(~found & salient)
    return {
        "accuracy": (tp + tn) / (tp + tn + fp + fn),
        "precision": tp / (tp + fp) if tp + fp else None,
        "recall": tp / (tp + fn) if tp + fn else None,
        "f1": 2 * tp / (2 * tp + fp + fn) if tp + fp + fn else None,
    }


def referee(folder):
    names = sorted(path.relative_to(folder / "truth") for path in (folder / "truth").rglob("*.pfm"))
    truth = [read_pfm(folder / "truth" / name) for name in names]
    found = [read_pfm(folder / "disparity" / name) for name in names]
    scores = {}
    if names:
        scores["disparity"] = disparity_score(list(zip(found, truth)))
        scores["filled"] = disparity_score([(filled(d), t) for d, t in zip(found, truth)])
    if names and (folder / "confidence").is_dir():
        confidence = [read_pfm(folder / "confidence" / name) for name in names]
        scores["sparsification"] = sparsification(list(zip(found, confidence, truth)))
    masks = sorted(path.relative_to(folder / "salient") for path in (folder / "salient").rglob("*.png"))
    if masks:
        scores["salient"] = pixel_score(
            [(read_mask(folder / "found" / name), read_mask(folder / "salient" / name)) for name in masks])
    if not scores:
        sys.exit(f"{folder}: neither truth/*.pfm nor salient/*.png")
    return scores


def differ(a, b):
    """Text about how two values differ; empty when they agree."""
    if a is None or b is None:
        return "" if a is b else f"{a}, {b} expected"
    a, b = np.asarray(a, float), np.asarray(b, float)
    if a.shape != b.shape:
        return f"{a.size} values, {b.size} expected"
    worst = np.max(np.abs(a - b))
    # Written so that NaN is a fault.
    return "" if worst <= TOLERANCE else f"off by {worst:.2e}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("scores", nargs="?")
    args = parser.parse_args()
    rows = referee(args.folder)
    if args.scores is None:
        print("| row | figure | value |\n|---|---|---|")
        for name, row in rows.items():
            for key, value in (row or {}).items():
                if np.ndim(value) == 0:
                    print(f"| {name} | {key} | " + ("-" if value is None else f"{value:.4f}") + " |")
        return
    scores = json.loads(Path(args.scores).read_text())
    faults = [f"{name}: missing" for name in rows if name not in scores]
    for name, row in rows.items():
        ours = scores.get(name)
        if (ours is None) != (row is None):
            faults.append(f"{name}: {ours}, {row} expected")
            continue
        for key, value in (row or {}).items():
            fault = differ(ours.get(key), value)
            if fault:
                faults.append(f"{name}.{key}: {fault}")
    print("\n".join(faults) if faults else "all figures agree")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
