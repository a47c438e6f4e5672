//! What is kept of a frame that the report shows.

use serde_json::{Value, json};

use super::ReportError;
use super::layer::{Layer, OUTSIDE, ValueLayer};
use crate::image::{Image, Size};
use crate::output::html::text::hex;
use crate::output::picture::{self, BORDER, Colormap, SALIENT};
use crate::perception::{Perception, Region, TrackState};

/// Pictures wider than this are made smaller by a whole factor.
const MAX_WIDTH: usize = 1400;

/// Quality of the camera images.
const JPEG_QUALITY: u8 = 80;

/// One frame, compressed.
#[derive(Clone, Debug)]
pub struct Kept {
    /// Number of the frame in the run, from 0.
    pub index: u64,
    /// Its time, for people.
    pub time: String,
    /// Size of the view, in which all coordinates are.
    pub size: Size,
    /// Camera image, JPEG.
    pub left: Vec<u8>,
    /// Attention map.
    pub saliency: Layer,
    /// Region of interest.
    pub roi: Layer,
    /// Disparity in pixels.
    pub disparity: ValueLayer,
    /// Depth in metres.
    pub depth: ValueLayer,
    /// The regions as the page's script wants them.
    pub regions: Value,
    /// Candidates that did not become regions.
    pub rejected: u32,
}

impl Kept {
    /// Compresses what is shown of one frame.
    pub fn encode(perception: &Perception, index: u64, time: String) -> Result<Self, ReportError> {
        let size = perception.left.gray.size();
        let stride = size.width.div_ceil(MAX_WIDTH).max(1);
        let failed = |source| ReportError::Layer { frame: index, source };
        let matched = &perception.roi.matched;
        Ok(Self {
            index,
            time,
            size,
            left: left(perception, stride)
                .map_err(|source| ReportError::Picture { frame: index, source })?,
            saliency: saliency(perception).map_err(failed)?,
            roi: roi(perception, stride).map_err(failed)?,
            disparity: ValueLayer::encode(&perception.disparity, matched, false, stride)
                .map_err(failed)?,
            depth: ValueLayer::encode(&perception.depth, matched, true, stride).map_err(failed)?,
            regions: perception.regions.iter().map(region).collect(),
            rejected: perception.rejections.total(),
        })
    }

    /// Bytes of all pictures.
    pub fn weight(&self) -> usize {
        let layers = [&self.saliency, &self.roi, &self.disparity.layer, &self.depth.layer];
        self.left.len() + layers.iter().map(|layer| layer.bytes().len()).sum::<usize>()
    }
}

fn left(perception: &Perception, stride: usize) -> Result<Vec<u8>, picture::PictureError> {
    let rgb = &perception.left.rgb;
    let colorless = rgb.pixels().iter().all(|[r, g, b]| r == g && g == b);
    let size = rgb.size().divided_by(stride);
    let averaged = |channel: &dyn Fn([u8; 3]) -> u8, x: usize, y: usize| {
        let (x0, y0) = (x * stride, y * stride);
        let (x1, y1) = ((x0 + stride).min(rgb.width()), (y0 + stride).min(rgb.height()));
        let cells = (y0..y1).flat_map(|y| &rgb.row(y)[x0..x1]);
        let sum: u32 = cells.map(|pixel| u32::from(channel(*pixel))).sum();
        (sum / ((x1 - x0) * (y1 - y0)) as u32) as u8
    };
    if colorless {
        let gray = Image::from_fn(size, |x, y| averaged(&|[r, _, _]| r, x, y));
        return picture::jpeg_gray(&gray, JPEG_QUALITY);
    }
    if stride == 1 {
        return picture::jpeg(rgb, JPEG_QUALITY);
    }
    let small = Image::from_fn(size, |x, y| {
        [0, 1, 2].map(|i: usize| averaged(&|pixel: [u8; 3]| pixel[i], x, y))
    });
    picture::jpeg(&small, JPEG_QUALITY)
}

/// Heat whose opacity grows with the attention, one pixel per cell: more is not in it.
fn saliency(perception: &Perception) -> Result<Layer, png::EncodingError> {
    let map = &perception.attention;
    // NaN becomes 0 in the conversion.
    let indices = Image::from_fn(map.size(), |x, y| (map.get(x, y).clamp(0.0, 1.0) * 255.0) as u8);
    let alpha: Vec<u8> = (0..=255_u32).map(|i| (70 + i * 160 / 255) as u8).collect();
    Layer::encode(&indices, Colormap::Inferno.table(), &alpha)
}

/// Salient pixels tinted, the matched border in another colour, the rest dim.
fn roi(perception: &Perception, stride: usize) -> Result<Layer, png::EncodingError> {
    let (salient, matched) = (&perception.roi.salient, &perception.roi.matched);
    let size = matched.size().divided_by(stride);
    let indices = Image::from_fn(size, |x, y| {
        let (x, y) = (x * stride, y * stride);
        if salient.get(x, y) != 0 {
            2
        } else if matched.get(x, y) != 0 {
            1
        } else {
            OUTSIDE
        }
    });
    Layer::encode(&indices, &[[6, 8, 12], BORDER, SALIENT], &[185, 130, 75])
}

fn region(region: &Region) -> Value {
    let state = match region.track_state {
        TrackState::None | TrackState::Active => "",
        TrackState::New => "new",
        TrackState::Coasted => "coasted",
    };
    let name = if region.track_id == 0 {
        format!("{}", region.label)
    } else {
        format!("#{}", region.track_id)
    };
    let speed = region.velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
    let extent = region.extent.iter().all(|v| v.is_finite()).then_some(region.extent);
    // Pixel centres are whole numbers in a contour; in the page's coordinates
    // pixel (0, 0) reaches from 0 to 1.
    let contour: Vec<[f64; 2]> = region
        .contour
        .iter()
        .filter(|point| point.iter().all(|v| v.is_finite()))
        .map(|point| point.map(|v| rounded(f64::from(v) + 0.5, 10.0)))
        .collect();
    json!({
        "key": format!("{}-{}", region.track_id, region.label),
        "name": name,
        "state": state,
        "color": hex(picture::region_color(region)),
        "box": [region.x, region.y, region.width, region.height],
        "contour": contour,
        "distance": finite(region.median_depth),
        "deviation": finite(region.depth_stddev),
        "near": finite(region.near_depth),
        "far": finite(region.far_depth),
        "size": extent.map(|size| size.map(|v| rounded(v, 1000.0))),
        "speed": speed.is_finite().then(|| rounded(speed, 1000.0)),
        "confidence": finite(region.confidence),
        "saliency": finite(region.mean_saliency),
    })
}

fn finite(value: f32) -> Option<f64> {
    value.is_finite().then(|| rounded(f64::from(value), 1000.0))
}

fn rounded(value: f64, unit: f64) -> f64 {
    (value * unit).round() / unit
}
