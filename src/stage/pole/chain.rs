//! Ridges of one thing, band below band.

use super::band::{Ridge, Ridges, WIDEST};

/// Ridges of a chain, at least: forty rows.
const LEAST: usize = 5;
/// Bands in a row that need not show it.
const MOST_GAP: usize = 2;
/// By how much its middle may move from band to band, pixels, and its brightness, of 255.
const STEP_PX: f32 = 1.6;
const STEP_BRIGHTNESS: f32 = 25.0;
/// How much of the next ridge place and brightness take.
const NEW_PLACE: f32 = 0.5;
const NEW_BRIGHTNESS: f32 = 0.3;
/// What a difference of brightness is worth in pixels when two ridges may follow.
const PER_STRENGTH: f32 = 0.05;

/// A ridge and the band that it is in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Index of the band.
    pub band: usize,
    /// The ridge.
    pub ridge: Ridge,
}

/// Chains of ridges, with the buffers of their search.
#[derive(Debug, Default)]
pub struct Chains {
    used: Vec<bool>,
    links: Vec<Link>,
    /// Indices of the ridges of the chain at work.
    indices: Vec<usize>,
    ends: Vec<usize>,
}

impl Chains {
    /// Links `ridges` downward.
    pub fn find(&mut self, ridges: &Ridges) {
        self.used.clear();
        self.used.resize(ridges.list().len(), false);
        self.links.clear();
        self.ends.clear();
        for (band, span) in ridges.bands().enumerate() {
            for i in span {
                if !self.used[i] {
                    self.follow(ridges, band, i);
                }
            }
        }
    }

    /// The chains, each from its upper end downward.
    pub fn iter(&self) -> impl Iterator<Item = &[Link]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, end)| &self.links[start..*end])
    }

    /// Follows ridge `i` of `band` downward, and keeps what is long enough.
    fn follow(&mut self, ridges: &Ridges, mut band: usize, i: usize) {
        let start = self.links.len();
        let mut ridge = ridges.list()[i];
        let (mut centre, mut mean) = (ridge.centre(), ridge.mean);
        self.links.push(Link { band, ridge });
        self.indices.clear();
        self.indices.push(i);
        while let Some((below, next)) = (band + 1..=band + 1 + MOST_GAP)
            .find_map(|below| Some((below, self.next(ridges, below, centre, mean)?)))
        {
            band = below;
            ridge = ridges.list()[next];
            centre += NEW_PLACE * (ridge.centre() - centre);
            mean += NEW_BRIGHTNESS * (ridge.mean - mean);
            self.links.push(Link { band, ridge });
            self.indices.push(next);
        }
        if self.indices.len() < LEAST {
            self.links.truncate(start);
            return;
        }
        for i in &self.indices {
            self.used[*i] = true;
        }
        self.ends.push(self.links.len());
    }

    /// The ridge of a band that goes on best where the last one was.
    fn next(&self, ridges: &Ridges, band: usize, centre: f32, mean: f32) -> Option<usize> {
        // The widest begin farthest to the left.
        let from = centre - STEP_PX - WIDEST as f32 / 2.0;
        let mut best = None;
        for i in ridges.from(band, from.max(0.0) as usize) {
            let ridge = &ridges.list()[i];
            if ridge.x as f32 > centre + STEP_PX {
                break;
            }
            let apart = (ridge.centre() - centre).abs();
            let same = apart <= STEP_PX && (ridge.mean - mean).abs() <= STEP_BRIGHTNESS;
            let worth = PER_STRENGTH * ridge.strength - apart;
            if same && !self.used[i] && best.is_none_or(|(_, most)| worth > most) {
                best = Some((i, worth));
            }
        }
        best.map(|(i, _)| i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Image, Size};
    use crate::simd;

    /// Bands of a stripe of four pixels whose place and brightness are told per band.
    fn chains(stripe: impl Fn(usize) -> Option<(usize, f32)>) -> Vec<Vec<Link>> {
        let bands = Image::from_fn(Size::new(80, 12), |x, y| match stripe(y) {
            Some((at, brightness)) if (at..at + 4).contains(&x) => brightness,
            _ => 100.0,
        });
        let mut ridges = Ridges::new(simd::detect());
        ridges.find(&bands, 12);
        let mut chains = Chains::default();
        chains.find(&ridges);
        chains.iter().map(<[Link]>::to_vec).collect()
    }

    #[test]
    fn what_goes_on_downward_is_one_chain() {
        // Two bands do not show it.
        let found = chains(|y| (y != 4 && y != 5).then_some((30, 140.0)));
        assert_eq!(found.len(), 1);
        let bands: Vec<_> = found[0].iter().map(|link| link.band).collect();
        assert_eq!(bands, [0, 1, 2, 3, 6, 7, 8, 9, 10, 11]);
        // It leans.
        let found = chains(|y| Some((30 + y / 2, 140.0)));
        assert_eq!(found.len(), 1);
        assert!(found[0].iter().all(|link| link.ridge.x == 30 + link.band / 2));
        assert_eq!(found[0].len(), 12);
    }

    #[test]
    fn a_gap_a_jump_and_another_brightness_end_it() {
        let ends = |stripe: &dyn Fn(usize) -> Option<(usize, f32)>| {
            chains(stripe).iter().map(|chain| chain[chain.len() - 1].band).collect::<Vec<_>>()
        };
        assert_eq!(ends(&|y| (!(6..9).contains(&y)).then_some((30, 140.0))), [5]);
        assert_eq!(ends(&|y| Some((if y < 6 { 30 } else { 34 }, 140.0))), [5, 11]);
        assert_eq!(ends(&|y| Some((30, if y < 6 { 140.0 } else { 170.0 }))), [5, 11]);
        // Four bands are none.
        assert!(ends(&|y| (y < 4).then_some((30, 140.0))).is_empty());
    }
}
