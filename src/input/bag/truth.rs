//! True disparity and object ids that a bag carries beside its images.

use std::collections::BTreeMap;

use crate::image::{Image, Picture, Size};
use crate::input::Truth;
use crate::ros::cdr;
use crate::ros::convert;
use crate::ros::message::sensor_msgs::CompressedImage;
use crate::stamp::Stamp;

/// Truth messages kept while their pair is not there yet, and pairs kept while
/// their truth is not.
const WAITING: usize = 16;

/// Truth that waits for its pair.
pub struct TruthQueue {
    disparity: Option<Queue>,
    objects: Option<Queue>,
}

#[derive(Default)]
struct Queue {
    waiting: BTreeMap<Stamp, Vec<u8>>,
    newest: Option<Stamp>,
}

impl TruthQueue {
    /// For the kinds of truth that the bag has.
    pub fn new(disparity: bool, objects: bool) -> Self {
        Self { disparity: disparity.then(Queue::default), objects: objects.then(Queue::default) }
    }

    /// Takes an encoded disparity map.
    pub fn push_disparity(&mut self, stamp: Stamp, data: Vec<u8>) {
        if let Some(queue) = &mut self.disparity {
            queue.push(stamp, data);
        }
    }

    /// Takes an encoded map of object ids.
    pub fn push_objects(&mut self, stamp: Stamp, data: Vec<u8>) {
        if let Some(queue) = &mut self.objects {
            queue.push(stamp, data);
        }
    }

    /// True when no more truth is to be expected for the oldest of `pairs`
    /// pairs, which has this stamp.
    pub fn is_complete(&self, stamp: Stamp, pairs: usize) -> bool {
        let settled = |queue: &Option<Queue>| {
            queue.as_ref().is_none_or(|q| q.newest.is_some_and(|newest| newest >= stamp))
        };
        pairs > WAITING || (settled(&self.disparity) && settled(&self.objects))
    }

    /// The truth of the pair with this stamp, and what is wrong with it.
    pub fn take(&mut self, stamp: Stamp, size: Size) -> (Option<Truth>, Option<String>) {
        let mut fault = None;
        let mut note = |result: Result<Option<Truth>, String>| match result {
            Ok(truth) => truth.unwrap_or_default(),
            Err(reason) => {
                fault = Some(reason);
                Truth::default()
            }
        };
        let disparity = self.disparity.as_mut().and_then(|queue| queue.take(stamp));
        let disparity = note(
            disparity
                .map(|data| disparity_of(&data, size).map_err(|e| format!("true disparity: {e}")))
                .transpose()
                .map(|image| {
                    image.map(|image| Truth { disparity: Some(image), ..Truth::default() })
                }),
        );
        let objects = self.objects.as_mut().and_then(|queue| queue.take(stamp));
        let objects = note(
            objects
                .map(|data| objects_of(&data, size).map_err(|e| format!("true objects: {e}")))
                .transpose()
                .map(|image| image.map(|image| Truth { objects: Some(image), ..Truth::default() })),
        );
        let truth =
            Truth { disparity: disparity.disparity, objects: objects.objects, ..Truth::default() };
        let any = truth.disparity.is_some() || truth.objects.is_some();
        (any.then_some(truth), fault)
    }
}

impl Queue {
    fn push(&mut self, stamp: Stamp, data: Vec<u8>) {
        if self.newest.is_some_and(|newest| stamp < newest) {
            self.waiting.clear();
        }
        self.newest = Some(stamp);
        self.waiting.insert(stamp, data);
        while self.waiting.len() > WAITING {
            self.waiting.pop_first();
        }
    }

    fn take(&mut self, stamp: Stamp) -> Option<Vec<u8>> {
        let found = self.waiting.remove(&stamp);
        // What is older belongs to images that were not used.
        self.waiting = self.waiting.split_off(&stamp);
        found
    }
}

/// Pixels of disparity: value / 256, NaN for 0.
fn disparity_of(data: &[u8], size: Size) -> Result<Image<f32>, String> {
    let message: CompressedImage = cdr::decode(data).map_err(|e| e.to_string())?;
    let coded = convert::compressed_u16(&message).map_err(|e| e.to_string())?;
    check(coded.size(), size)?;
    let mut disparity = Image::new(size);
    for (d, &value) in disparity.pixels_mut().iter_mut().zip(coded.pixels()) {
        *d = if value == 0 { f32::NAN } else { f32::from(value) / 256.0 };
    }
    Ok(disparity)
}

/// Ids of 8 or 16 bits.
fn objects_of(data: &[u8], size: Size) -> Result<Image<u16>, String> {
    let message: CompressedImage = cdr::decode(data).map_err(|e| e.to_string())?;
    let ids = match convert::compressed_u16(&message) {
        Ok(ids) => ids,
        Err(convert::ConvertError::Depth { .. }) => {
            match convert::compressed_picture(&message).map_err(|e| e.to_string())? {
                Picture::Gray(ids) => {
                    let mut wide = Image::new(ids.size());
                    for (to, &from) in wide.pixels_mut().iter_mut().zip(ids.pixels()) {
                        *to = u16::from(from);
                    }
                    wide
                }
                Picture::Rgb(_) => return Err("ids are gray values, not colours".to_owned()),
            }
        }
        Err(e) => return Err(e.to_string()),
    };
    check(ids.size(), size)?;
    Ok(ids)
}

fn check(found: Size, image: Size) -> Result<(), String> {
    if found == image { Ok(()) } else { Err(format!("{found} for an image of {image}")) }
}
