//! Poles that no thing contains.

use crate::image::Image;
use crate::stage::pole::Pole;
use crate::stage::regions::candidates::{Candidates, PixelBox};

/// Share of a pole's pixels that things may have that were found before.
const MOST_KNOWN: f32 = 0.3;

/// Makes a candidate of each of `poles` of which little belongs to others yet, less what is
/// hidden by something nearer.
pub fn adopt(poles: &[Pole], disparity: &Image<f32>, out: &mut Candidates) {
    let width = out.ids.width();
    for pole in poles {
        let rows = || pole.rows.clone().map(|y| (y, pole.columns(y, width)));
        let area: usize = rows().map(|(_, columns)| columns.len()).sum();
        let known: usize = rows()
            .map(|(y, columns)| {
                let ids = &out.ids.row(y)[columns];
                ids.iter().filter(|id| **id >= out.first).count()
            })
            .sum();
        let id = out.first.saturating_add(out.boxes.len() as u32);
        if area == 0 || known as f32 > MOST_KNOWN * area as f32 || id == Candidates::NEVER {
            continue;
        }
        let mut bounds = PixelBox::NONE;
        for (y, columns) in rows() {
            let (x0, row) = (columns.start, &mut out.ids.row_mut(y)[columns]);
            for (i, pixel) in row.iter_mut().enumerate() {
                if *pixel < out.first && !pole.is_hidden_by(disparity.get(x0 + i, y)) {
                    *pixel = id;
                    bounds.add(x0 + i, y, 1);
                }
            }
        }
        out.boxes.push(bounds);
    }
}
