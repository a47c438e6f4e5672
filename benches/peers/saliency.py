#!/usr/bin/env python3
"""Attention maps of every method, scored by pysodmetrics beside two baselines that never look at the picture.

    pip install -r tests/interop/requirements.txt
    python benches/peers/saliency.py --tool target/release/salient_stereo saliency DUTS_FOLDER MASKS_FOLDER
    python benches/peers/saliency.py --tool target/release/salient_stereo davis DAVIS_FOLDER DAVIS_FOLDER/Annotations/480p

The tool writes the maps (`evaluate --maps`), the referee reads the PNGs: nothing of our own metrics is in these
figures. Prints Markdown: one row per method and form of its maps, as they are and stretched to their full range.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "interop"))
import referee_saliency as referee  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", choices=["saliency", "davis"])
    parser.add_argument("path", help="folder of the data set")
    parser.add_argument("masks", help="folder of its masks, laid out as the images are")
    parser.add_argument("--tool", required=True, help="salient_stereo executable")
    parser.add_argument("--method", action="append", default=[], help="only this method (default: all)")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        maps = Path(work) / "maps"
        command = [args.tool, "evaluate", "--dataset", args.dataset, args.path, "--maps", maps, "--work",
                   Path(work) / "parts", "--json", Path(work) / "out.json"]
        for method in args.method:
            command += ["--method", method]
        subprocess.run([str(word) for word in command], check=True)
        print(f"| method | maps | {' | '.join(referee.SCALARS)} |\n|---|---{'|---' * len(referee.SCALARS)}|")
        for folder in sorted((maps / args.dataset).iterdir()):
            pairs = referee.read(folder, args.masks)
            for form, scores in referee.both(pairs.values()).items():
                figures = " | ".join(f"{scores[key]:.3f}" for key in referee.SCALARS)
                print(f"| {folder.name} | {form.replace('_', ' ')} | {figures} |")


if __name__ == "__main__":
    main()
