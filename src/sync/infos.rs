//! Camera infos of one camera, and which of them belongs to an image.

use std::collections::VecDeque;

use super::Settings;
use crate::config::CameraInfoPolicy;
use crate::stamp::Stamp;

/// One camera.
#[derive(Debug)]
pub struct Infos<C> {
    pub fixed: Option<C>,
    pub queue: VecDeque<(Stamp, C)>,
    pub newest: Option<Stamp>,
}

/// Whether there is an info for a stamp.
pub enum Found<C> {
    Info(C),
    NotYet,
    Never,
}

impl<C: Clone> Infos<C> {
    pub const fn new() -> Self {
        Self { fixed: None, queue: VecDeque::new(), newest: None }
    }

    pub fn find(&self, stamp: Stamp, settings: &Settings) -> Found<C> {
        if let Some(info) = &self.fixed {
            return Found::Info(info.clone());
        }
        let hit = match settings.camera_info {
            CameraInfoPolicy::Cached => self.queue.back(),
            CameraInfoPolicy::Synced => self.queue.iter().find(|(of, _)| *of == stamp),
        };
        match hit {
            Some((_, info)) => Found::Info(info.clone()),
            None if self.newest.is_some_and(|newest| newest > stamp) => Found::Never,
            None => Found::NotYet,
        }
    }
}
