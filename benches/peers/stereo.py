#!/usr/bin/env python3
"""Stereo accuracy and speed beside OpenCV's matchers, on the same images in the same run.

    pip install opencv-python-headless numpy mcap mcap-ros2-support
    python benches/peers/stereo.py KITTI_FOLDER --scene 000027 --bag out.mcap
    python benches/peers/stereo.py KITTI_FOLDER --scene 000027 --tool target/release/salient_stereo

KITTI_FOLDER holds training/image_0, image_1 (or colour image_2, image_3), disp_noc and disp_occ
(disp_noc_0 and disp_occ_0 in the 2015 layout). Middlebury scene folders of 2001 to 2021 are taken as they are.
Without --bag and --tool only OpenCV is measured, and --json writes its rows for `salient_stereo evaluate --peers`.

With --bag our disparity is read from an output bag of `salient_stereo replay` (topic /disparity) and scored
where we matched; with --tool the script runs the tool itself: `export-bag` and `replay` for the disparity of the
full frame, scored in centred rectangles as well, and `bench` for the time. Prints Markdown.

Columns: EPE is the mean error in px, D1 the share of errors above 3 px and 5 %, bad-2 that above 2 px, all on
non-occluded pixels that the method itself calls valid; "dense" is their share of the true pixels. "Same" columns
are on the pixels where both this method and we are valid: this method / we. "Filled" ones are over all true
pixels (occluded ones included) after every hole took the smaller disparity of its row neighbours.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from readme import splice

STEP = 16.0


def opencv_matchers(disparities):
    """Name -> matcher, with the settings of OpenCV's own sample for SGBM (block 5)."""
    block = 5
    p1, p2 = 8 * block * block, 32 * block * block

    def sgbm(mode, speckle):
        return cv2.StereoSGBM_create(
            0, disparities, block, p1, p2, 1, 63, 10, 100 if speckle else 0, 2 if speckle else 0, mode)

    block_matcher = cv2.StereoBM_create(disparities, 15)
    return {
        "SGBM": sgbm(cv2.STEREO_SGBM_MODE_SGBM, False),
        "SGBM + speckle filter": sgbm(cv2.STEREO_SGBM_MODE_SGBM, True),
        "SGBM_3WAY": sgbm(cv2.STEREO_SGBM_MODE_SGBM_3WAY, False),
        "BM 15": block_matcher,
    }


def read_pfm(path):
    with open(path, "rb") as file:
        file.readline()
        width, height = map(int, file.readline().split())
        scale = float(file.readline())
        data = np.frombuffer(file.read(), "<f4" if scale < 0 else ">f4").reshape(height, width)
    data = data[::-1].astype(np.float32)
    return np.where(np.isfinite(data), data, 0)


def read_kitti_disparity(path):
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        sys.exit(f"{path}: cannot be read as an image")
    return image.astype(np.float32) / 256


def gray(path):
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        sys.exit(f"{path}: cannot be read as an image")
    return image


class Scene:
    """One pair with its truth: `noc` and `occ` in px, 0 where unknown."""

    def __init__(self, folder, scene=None, frame="10"):
        folder = Path(folder)
        self.kitti = None
        # The name that `evaluate` gives it: the folders from the one of the year on.
        parts = folder.absolute().parts
        years = [i for i, part in enumerate(parts) if part.lower().startswith("middlebury")]
        self.dataset, self.scene = "middlebury", "/".join(parts[years[-1]:]) if years else folder.name
        if (folder / "im0.png").exists():
            self.left, self.right = folder / "im0.png", folder / "im1.png"
            truth = next(p for p in (folder / "disp0GT.pfm", folder / "disp0.pfm") if p.exists())
            self.occ = read_pfm(truth)
            # Only the evaluation of 2014 (version 3) tells what both views see.
            mask = folder / "mask0nocc.png"
            self.noc = self.occ * (gray(mask) == 255) if mask.exists() else self.occ
        elif (folder / "imL.png").exists():
            # Version 2 of the Middlebury evaluation: the scale of the map stands in info.txt.
            self.left, self.right = folder / "imL.png", folder / "imR.png"
            scale = self.scale_of(folder)
            self.occ = gray(folder / "groundtruth.png").astype(np.float32) / scale
            self.noc = self.occ * (gray(folder / "nonocc.png") == 255)
        elif (folder / "view1.png").exists():
            # 2005 and 2006: pixels at full size, so half of that at half size.
            self.left, self.right = folder / "view1.png", folder / "view5.png"
            parts = [part.lower() for part in folder.resolve().parts]
            divisor = 2 if "halfsize" in parts else 3 if "thirdsize" in parts else 1
            self.occ = gray(folder / "disp1.png").astype(np.float32) / divisor
            self.noc = self.occ
        elif any(folder.glob("*GT.png")):
            truth = next(iter(folder.glob("*GT.png")))
            stem = truth.name[: -len("GT.png")]
            self.left, self.right = (next(folder.glob(f"{stem}{side}.*")) for side in "LR")
            self.occ = gray(truth).astype(np.float32)
            self.noc = self.occ
        else:
            training = folder / "training" if (folder / "training").is_dir() else folder
            is_2012 = (training / "disp_noc").is_dir()
            left, right = ("image_0", "image_1") if (training / "image_0").is_dir() else ("image_2", "image_3")
            name = f"{scene}_{frame}.png"
            self.left, self.right = training / left / name, training / right / name
            suffix = "" if is_2012 else "_0"
            self.noc = read_kitti_disparity(training / f"disp_noc{suffix}" / name)
            self.occ = read_kitti_disparity(training / f"disp_occ{suffix}" / name)
            self.dataset, self.scene = "kitti2012" if is_2012 else "kitti2015", scene
            self.kitti = (folder, scene, frame)
        self.name = self.left.stem if self.kitti else folder.name

    @staticmethod
    def scale_of(folder):
        """Gray levels per pixel: the first number of `info.txt`; the second is the largest disparity."""
        info = folder / "info.txt"
        if not info.exists():
            sys.exit(f"{info} is missing: the scale of the 8-bit disparities")
        return float(info.read_text().split()[0])

    def position(self):
        """Number of this pair among those of its scene, which is its number in a bag of the scene."""
        if self.kitti is None:
            return 0
        _, name, _ = self.kitti
        return sorted(p.stem for p in self.left.parent.glob(f"{name}_*.png")).index(self.name)


def scenes_of(folder, wanted, frame):
    """The scenes of a KITTI folder, or the one that a Middlebury folder is."""
    folder = Path(folder)
    training = folder / "training" if (folder / "training").is_dir() else folder
    for truth in (training / "disp_noc", training / "disp_noc_0"):
        if truth.is_dir():
            names = wanted or sorted(p.stem.split("_")[0] for p in truth.glob(f"*_{frame}.png"))
            return [Scene(folder, name, frame) for name in names]
    return [Scene(folder)]


def centred(shape, fraction):
    height, width = shape
    side = np.sqrt(fraction)
    h, w = int(height * side), int(width * side)
    mask = np.zeros(shape, bool)
    y, x = (height - h) // 2, (width - w) // 2
    mask[y:y + h, x:x + w] = True
    return mask


def filled(disparity):
    out = disparity.copy()
    for row in out:
        known = np.flatnonzero(~np.isnan(row))
        if known.size == 0:
            row[:] = 0
            continue
        holes = np.flatnonzero(np.isnan(row))
        after = np.searchsorted(known, holes)
        left = row[known[np.clip(after - 1, 0, known.size - 1)]]
        right = row[known[np.clip(after, 0, known.size - 1)]]
        both = np.minimum(left, right)
        row[holes] = np.where(after == 0, right, np.where(after == known.size, left, both))
    return out


def errors(disparity, truth, mask):
    """EPE, D1 %, bad-2 %, density % over the true pixels of `mask`."""
    true = (truth > 0) & mask
    valid = true & ~np.isnan(disparity)
    if not valid.any():
        return (float("nan"),) * 3 + (0.0,)
    error = np.abs(disparity - truth)[valid]
    d1 = (error > 3) & (error > 0.05 * truth[valid])
    return error.mean(), 100 * d1.mean(), 100 * (error > 2).mean(), 100 * valid.sum() / true.sum()


def sparsification(disparity, confidence, truth, mask):
    """AUSE: area between error curves when pixels go by confidence and by true error (both as shares of the EPE)."""
    valid = (truth > 0) & mask & ~np.isnan(disparity) & (confidence > 0)
    if valid.sum() < 100:
        return float("nan")
    error = np.abs(disparity - truth)[valid]

    def curve(order):
        kept = error[order]
        return np.array([kept[int(len(kept) * share):].mean() for share in np.arange(0, 1, 0.05)]) / error.mean()

    by_confidence = curve(np.argsort(confidence[valid], kind="stable"))
    by_error = curve(np.argsort(-error, kind="stable"))
    return float((by_confidence - by_error).mean())


def read_bag(path, frame):
    """Disparity and confidence of pair number `frame` of an output bag (NaN and 0 where there is none)."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    disparity, confidence = [], []
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        topics = ["/disparity", "/confidence/image_rect"]
        for _, channel, _, message in reader.iter_decoded_messages(topics=topics):
            image = message.image if channel.topic == "/disparity" else message
            rows = np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.step)
            pixels = rows[:, : 4 * image.width].copy().view("<f4")
            if channel.topic == "/disparity":
                pixels[pixels < message.min_disparity] = np.nan
                disparity.append(pixels)
            else:
                confidence.append(pixels)
    if not -len(disparity) <= frame < len(disparity):
        sys.exit(f"{path}: {len(disparity)} disparity images, number {frame} wanted")
    return disparity[frame], confidence[frame] if len(confidence) == len(disparity) else None


def replay(tool, scene, disparities, work):
    """Runs our own matcher over the full frame; returns disparity and confidence."""
    bag, out = work / "in.mcap", work / "out.mcap"
    if scene.kitti:
        folder, name, _ = scene.kitti
        source = ["--dataset", scene.dataset, "--scene", name, folder]
    else:
        # Depth plays no part here: any focal length and baseline will do.
        source = ["--left", scene.left, "--right", scene.right, "--focal", 1000, "--baseline", 0.1, "--offset", 0]

    def run(*args):
        subprocess.run([str(a) for a in (tool, *args)], check=True, stdout=subprocess.DEVNULL)

    run("export-bag", *source, "-o", bag)
    run("replay", bag, "-o", out, "--set", "saliency.mode=full_frame",
        "--set", f"stereo.disparity_range={disparities}")
    return read_bag(out, scene.position())


def bench(tool, scene, fraction, disparities, frames, threads):
    """p50 of matching in ms, by our own clock."""
    command = [tool, "bench", "--left", scene.left, "--right", scene.right, "--roi", fraction,
               "--disparities", disparities, "--threads", threads, "--frames", frames, "--json", "-"]
    text = subprocess.run([str(a) for a in command], check=True, capture_output=True, text=True).stdout
    matching = json.loads(text)["matching_ms"]
    return matching["p50"] if isinstance(matching, dict) else matching


PEER = "SGBM + speckle filter"


def summary(rows, args):
    """The figures of all scenes in one table per rectangle."""
    lines = [f"Ranges 0..{args.disparities}; {args.rounds} interleaved rounds, medians; OpenCV {cv2.__version__} on one "
             "thread. EPE, D1, bad-2 and density over non-occluded pixels; filled: all true pixels after every hole took "
             "the smaller disparity of its row neighbours. Pairs of figures: we / OpenCV SGBM + speckle filter. "
             "Errors in a rectangle are those of the full-frame disparity inside it; times are of the rectangle alone."]
    for fraction in args.roi or [0.25, 1.0]:
        where = "full frame" if fraction >= 1 else f"centred {100 * fraction:.0f} %"
        lines += ["", f"| {where} | times faster than SGBM, 1 / 2 threads | EPE px | D1 % | bad-2 % | dense % "
                  "| filled EPE px | filled D1 % | AUSE |", "|---|---|---|---|---|---|---|---|---|"]
        for row in rows:
            one, two = (row["faster"].get((fraction, threads), float("nan")) for threads in (1, 2))
            (epe, d1, bad, dense), (peer_epe, peer_d1, peer_bad, peer_dense) = row["errors"][where]
            (filled_epe, filled_d1), (peer_filled_epe, peer_filled_d1) = row["filled"][where]
            lines.append(
                f"| {row['name']} | {one:.1f} / {two:.1f} | {epe:.2f} / {peer_epe:.2f} | {d1:.1f} / {peer_d1:.1f} "
                f"| {bad:.1f} / {peer_bad:.1f} | {dense:.1f} / {peer_dense:.1f} | {filled_epe:.2f} / {peer_filled_epe:.2f} "
                f"| {filled_d1:.1f} / {peer_filled_d1:.1f} | {row['ause'][where]:.2f} |")
    return "\n".join(lines) + "\n"


def measure(scene, args, peers, rows):
    """Prints the tables of one scene, adds the rows of the others to `peers` and the summary to `rows`."""
    left, right = gray(scene.left), gray(scene.right)
    matchers = opencv_matchers(args.disparities)
    fractions = args.roi or [0.25, 1.0]
    height, width = left.shape
    print(f"### {scene.name}: {width}x{height}, 0..{args.disparities}, OpenCV {cv2.__version__}, one thread\n")

    # Time: one round is every matcher once, so that all meet the same machine.
    times = {name: [] for name in matchers}
    ours = {(fraction, threads): [] for fraction in fractions for threads in (1, 2)}
    found = {}
    for _ in range(args.rounds):
        for name, matcher in matchers.items():
            start = time.perf_counter()
            raw = matcher.compute(left, right)
            times[name].append(1e3 * (time.perf_counter() - start))
            found[name] = np.where(raw < 0, np.nan, raw.astype(np.float32) / STEP)
        if args.tool:
            for fraction, threads in ours:
                ours[fraction, threads].append(
                    bench(args.tool, scene, fraction, args.disparities, 10, threads))
    reference = statistics.median(times["SGBM"])
    print("| matcher | matching ms (median) | times faster than SGBM |\n|---|---|---|")
    for name, values in times.items():
        middle = statistics.median(values)
        print(f"| OpenCV {name}, full frame | {middle:.1f} | {reference / middle:.1f} |")
    for (fraction, threads), values in ours.items():
        if values:
            middle = statistics.median(values)
            where = "full frame" if fraction >= 1 else f"centred {100 * fraction:.0f} % + border"
            plural = "s" if threads > 1 else ""
            print(f"| salient_stereo, {where}, {threads} thread{plural} | {middle:.2f} | {reference / middle:.1f} |")
    print()

    everywhere = np.ones(left.shape, bool)
    for name, disparity in found.items():
        epe, d1, bad, dense = errors(disparity, scene.noc, everywhere)
        filled_epe, filled_d1, _, _ = errors(filled(disparity), scene.occ, everywhere)
        known = int((scene.noc > 0).sum())
        peers.append({
            "dataset": scene.dataset, "scene": scene.scene, "method": f"OpenCV {name}", "version": cv2.__version__,
            "threads": 1, "matching_ms": statistics.median(times[name]), "known": known,
            "pixels": round(known * dense / 100), "known_with_occluded": int((scene.occ > 0).sum()),
            "epe_px": float(epe), "d1": float(d1) / 100, "bad_2": float(bad) / 100, "density": float(dense) / 100,
            "filled_epe_px": float(filled_epe), "filled_d1": float(filled_d1) / 100,
        })

    jobs = []
    if args.bag:
        frame = args.bag_frame
        if frame is None:
            frame = scene.position()
        disparity, confidence = read_bag(args.bag, frame)
        jobs.append(("where the bag has disparity", ~np.isnan(disparity), disparity, confidence))
    if args.tool:
        with tempfile.TemporaryDirectory() as work:
            disparity, confidence = replay(args.tool, scene, args.disparities, Path(work))
        for fraction in fractions:
            where = "full frame" if fraction >= 1 else f"centred {100 * fraction:.0f} %"
            jobs.append((where, centred(left.shape, fraction), disparity, confidence))
    total = {"name": scene.scene, "errors": {}, "filled": {}, "ause": {}}
    total["faster"] = {key: reference / statistics.median(values) for key, values in ours.items() if values}
    for where, mask, disparity, confidence in jobs:
        pair = (disparity, found[PEER])
        total["errors"][where] = [errors(d, scene.noc, mask) for d in pair]
        total["filled"][where] = [errors(filled(d), scene.occ, mask)[:2] for d in pair]
        total["ause"][where] = float("nan")
        print(f"**{where}**\n")
        print("| matcher | EPE px | D1 % | bad-2 % | dense % | same EPE: it / we | same D1: it / we "
              "| filled EPE | filled D1 % |\n|---|---|---|---|---|---|---|---|---|")
        for name, other in [("salient_stereo", disparity), *((f"OpenCV {n}", d) for n, d in found.items())]:
            epe, d1, bad, dense = errors(other, scene.noc, mask)
            same = mask & ~np.isnan(other) & ~np.isnan(disparity)
            it, we = errors(other, scene.noc, same), errors(disparity, scene.noc, same)
            all_epe, all_d1, _, _ = errors(filled(other), scene.occ, mask)
            print(f"| {name} | {epe:.3f} | {d1:.2f} | {bad:.2f} | {dense:.1f} | {it[0]:.3f} / {we[0]:.3f} "
                  f"| {it[1]:.2f} / {we[1]:.2f} | {all_epe:.3f} | {all_d1:.2f} |")
        if confidence is not None:
            area = sparsification(disparity, confidence, scene.noc, mask)
            total["ause"][where] = area
            print(f"\nConfidence of salient_stereo: AUSE {area:.3f} (0: as good as knowing the error).")
        print()
    rows.append(total)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="+", help="KITTI 2012/2015 folder, or Middlebury scene folders")
    parser.add_argument("--scene", action="append", help="KITTI scene number (default: all that have truth)")
    parser.add_argument("--frame", default="10", help="KITTI frame number (the one with truth is 10)")
    parser.add_argument("--bag", help="output bag of `salient_stereo replay` over the whole scene")
    parser.add_argument("--bag-frame", type=int, help="number of the pair in the bag (default: found by frame number)")
    parser.add_argument("--tool", help="salient_stereo executable, to measure accuracy of rectangles and time")
    parser.add_argument("--roi", type=float, action="append", help="share of the centred rectangle (0.25 and 1)")
    parser.add_argument("--disparities", type=int, default=192)
    parser.add_argument("--rounds", type=int, default=5, help="interleaved rounds of timing")
    parser.add_argument("--json", help="write OpenCV's rows here, for `salient_stereo evaluate --peers`")
    parser.add_argument("--readme", help="write the table of all scenes between the matcher's markers of this file")
    args = parser.parse_args()
    if args.readme and not args.tool:
        parser.error("--readme needs --tool")

    cv2.setNumThreads(1)
    scenes = [scene for folder in args.folder for scene in scenes_of(folder, args.scene, args.frame)]
    if args.bag and len(scenes) != 1:
        parser.error("a bag holds one scene: name it with --scene")
    peers, rows = [], []
    for scene in scenes:
        measure(scene, args, peers, rows)
    if args.tool:
        text = summary(rows, args)
        print(text)
        if args.readme:
            splice(args.readme, "matcher", text)
    if args.json:
        Path(args.json).write_text(json.dumps({"peers": peers}, indent=1))


if __name__ == "__main__":
    main()
