#!/usr/bin/env python3
"""Where it fails, in pictures: places of a bag with truth beside what was made of them.

    pip install -r tests/interop/requirements.txt opencv-python-headless numpy
    salient_stereo replay bags/street.mcap -o out/street.mcap
    python benches/gallery.py docs/failures.png bags/street.mcap out/street.mcap 20:0,80,320,160 …

A place is FRAME:X,Y,WIDTH,HEIGHT in pixels, frames counted from 0. Each becomes one row of OUT.png: the left image with
the outlines of the true objects (green: a region covers it at a mask IoU of .5 and more, red: none does, grey: smaller
than --least pixels, which nobody asks for), the attention map S with the line where it is cut, the disparity (near is
red, black has none), and the regions, each in a colour. Rows are lettered from a on.
"""

import argparse
import sys

import cv2
import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

LEFT, TRUTH = "/left/image_rect/compressed", "/truth/objects/compressed"
RESULTS = ("/saliency/image_rect", "/disparity", "/regions/label_image")
GREEN, RED, GREY, WHITE = (0, 220, 0), (0, 0, 255), (150, 150, 150), (255, 255, 255)


def messages(path, topics):
    """Messages of each topic, in order."""
    found = {topic: [] for topic in topics}
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages(topics=list(topics)):
            found[channel.topic].append(message)
    missing = [topic for topic, all_of_it in found.items() if not all_of_it]
    if missing:
        sys.exit(f"{path}: no message on {', '.join(missing)}")
    return found


def array(image, dtype):
    rows = np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.step)
    return rows.view(dtype)[:, :image.width]


def decoded(image, flags):
    return cv2.imdecode(np.frombuffer(bytes(image.data), np.uint8), flags)


def outlines(mask):
    return cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]


def panels(frame, source, result, least, threshold):
    """Full pictures of one frame."""
    left = decoded(source[LEFT][frame], cv2.IMREAD_COLOR)
    objects = decoded(source[TRUTH][frame], cv2.IMREAD_UNCHANGED)
    saliency, disparity, labels = (result[topic][frame] for topic in RESULTS)
    labels = array(labels, "<u2")
    saliency = array(saliency, "<f4")
    truth = left.copy()
    for thing in np.unique(objects[objects > 0]):
        mask = objects == thing
        covers = [(mask & (labels == label)).sum() / (mask | (labels == label)).sum()
                  for label in np.unique(labels[mask]) if label]
        colour = GREEN if max(covers, default=0) >= 0.5 else RED if mask.sum() >= least else GREY
        cv2.drawContours(truth, outlines(mask), -1, colour, 1)
    attention = cv2.applyColorMap((255 * np.clip(saliency, 0, 1)).astype(np.uint8), cv2.COLORMAP_INFERNO)
    cv2.drawContours(attention, outlines(saliency >= threshold), -1, WHITE, 1)
    found = array(disparity.image, "<f4")
    valid = found >= disparity.min_disparity
    depth = cv2.applyColorMap((255 * np.clip(found / max(found.max(), 1), 0, 1)).astype(np.uint8), cv2.COLORMAP_JET)
    depth[~valid] = 0
    regions = left // 2
    for label in np.unique(labels[labels > 0]):
        hue = np.uint8([[[int(label) * 47 % 180, 200, 255]]])
        regions[labels == label] = (0.45 * left[labels == label] + 0.55 * cv2.cvtColor(hue, cv2.COLOR_HSV2BGR)[0, 0])
    return [truth, attention, depth, regions]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", help="PNG to write")
    parser.add_argument("bag", help="bag with images and truth")
    parser.add_argument("result", help="what `salient_stereo replay` made of it")
    parser.add_argument("place", nargs="+", help="FRAME:X,Y,WIDTH,HEIGHT")
    parser.add_argument("--width", type=int, default=300, help="pixels of a panel")
    parser.add_argument("--least", type=int, default=150, help="pixels of the smallest object asked for")
    parser.add_argument("--threshold", type=float, default=0.55, help="saliency.threshold of the result")
    args = parser.parse_args()
    source, result = messages(args.bag, (LEFT, TRUTH)), messages(args.result, RESULTS)
    rows = []
    for letter, place in zip("abcdefghijklmnopqrstuvwxyz", args.place):
        frame, (x, y, width, height) = (part.split(",") for part in place.split(":"))
        frame, x, y, width, height = (int(number) for number in (frame[0], x, y, width, height))
        size = (args.width, round(height * args.width / width))
        row = [cv2.resize(panel[y:y + height, x:x + width], size, interpolation=cv2.INTER_CUBIC)
               for panel in panels(frame, source, result, args.least, args.threshold)]
        row = np.hstack([np.pad(panel, ((2, 2), (2, 2), (0, 0)), constant_values=255) for panel in row])
        cv2.putText(row, letter, (8, 22), cv2.FONT_HERSHEY_SIMPLEX, 0.7, (0, 0, 0), 4, cv2.LINE_AA)
        cv2.putText(row, letter, (8, 22), cv2.FONT_HERSHEY_SIMPLEX, 0.7, WHITE, 2, cv2.LINE_AA)
        rows.append(row)
    if not cv2.imwrite(args.out, np.vstack(rows)):
        sys.exit(f"{args.out}: cannot be written")


if __name__ == "__main__":
    main()
