//! Pictures of the best and the worst frame.

use crate::image::{Image, Size};
use crate::output::picture::{self, PictureError, Scale};
use crate::perception::Perception;

use super::part::Shot;
use super::store::Picture;

/// Largest width of one of the four tiles.
const TILE_WIDTH: usize = 480;
/// JPEG quality.
const QUALITY: u8 = 72;
/// Colour laid over true objects.
const TRUTH: [u8; 3] = [60, 220, 110];

/// The measure by which a frame is best or worst.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Its name.
    pub measure: &'static str,
    /// Its value in this frame.
    pub value: f64,
    /// True when more of it is better.
    pub more_is_better: bool,
}

/// Keeps the pictures of two frames.
#[derive(Debug, Default)]
pub struct Shots {
    best: Option<Kept>,
    worst: Option<Kept>,
}

#[derive(Debug)]
struct Kept {
    frame: u64,
    verdict: Verdict,
    jpeg: Vec<u8>,
}

impl Shots {
    /// Takes a frame if it is better or worse than all before.
    ///
    /// # Errors
    /// When the picture cannot be encoded.
    pub fn offer(
        &mut self,
        frame: u64,
        verdict: Verdict,
        perception: &Perception,
        objects: Option<&Image<u8>>,
    ) -> Result<(), PictureError> {
        let rank = |v: &Verdict| if v.more_is_better { v.value } else { -v.value };
        let new = rank(&verdict);
        let best = self.best.as_ref().is_none_or(|kept| new > rank(&kept.verdict));
        let worst = self.worst.as_ref().is_none_or(|kept| new < rank(&kept.verdict));
        if !best && !worst {
            return Ok(());
        }
        let jpeg = picture::jpeg(&tiles(perception, objects), QUALITY)?;
        let kept = || Kept { frame, verdict, jpeg: jpeg.clone() };
        if best {
            self.best = Some(kept());
        }
        if worst {
            self.worst = Some(kept());
        }
        Ok(())
    }

    /// What was kept, without the file names, and the pictures. A scene of one
    /// frame, or one in which all fare alike, has a worst frame only.
    pub fn finish(self) -> (Vec<Shot>, Vec<Picture>) {
        let same = match (&self.best, &self.worst) {
            (Some(best), Some(worst)) => best.frame == worst.frame,
            _ => false,
        };
        let best = self.best.filter(|_| !same);
        let kept = [("best", best), ("worst", self.worst)];
        kept.into_iter()
            .filter_map(|(role, kept)| {
                let kept = kept?;
                let shot = Shot {
                    role: role.to_owned(),
                    frame: kept.frame,
                    measure: kept.verdict.measure.to_owned(),
                    value: kept.verdict.value,
                    file: String::new(),
                };
                Some((shot, (role, kept.jpeg)))
            })
            .unzip()
    }
}

/// Four pictures in one: true objects, attention map, regions and disparity;
/// without disparity: the view, true objects, attention map, region of interest.
fn tiles(perception: &Perception, objects: Option<&Image<u8>>) -> Image<[u8; 3]> {
    let mut truth = perception.left.rgb.clone();
    if let Some(objects) = objects.filter(|objects| objects.size() == truth.size()) {
        for (pixel, _) in
            truth.pixels_mut().iter_mut().zip(objects.pixels()).filter(|(_, o)| **o != 0)
        {
            *pixel = std::array::from_fn(|i| pixel[i] / 2 + TRUTH[i] / 2);
        }
    }
    let mut attention = Image::default();
    picture::saliency(perception, &mut attention);
    let mut found = Image::default();
    let mut disparity = Image::default();
    let all = if perception.disparity.pixels().iter().any(|d| *d > 0.0) {
        picture::regions(perception, &mut found);
        picture::disparity(perception, &Scale::of_disparity(perception), &mut disparity);
        [&truth, &attention, &found, &disparity]
    } else {
        picture::roi(perception, &mut found);
        [&perception.left.rgb, &truth, &attention, &found]
    };
    let factor = truth.width().div_ceil(TILE_WIDTH).max(1);
    let tile = Size::new(truth.width() / factor, truth.height() / factor);
    Image::from_fn(Size::new(tile.width * 2, tile.height * 2), |x, y| {
        let number = y / tile.height.max(1) * 2 + x / tile.width.max(1);
        let (x, y) = (x % tile.width.max(1), y % tile.height.max(1));
        // The mean of the block: thin contours must not fall between samples.
        let mut sum = [0_u32; 3];
        for v in 0..factor {
            for u in 0..factor {
                let pixel = all[number].get(x * factor + u, y * factor + v);
                sum.iter_mut().zip(pixel).for_each(|(sum, c)| *sum += u32::from(c));
            }
        }
        sum.map(|sum| (sum / (factor * factor) as u32) as u8)
    })
}
