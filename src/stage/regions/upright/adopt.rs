//! Poles that no thing contains.

use crate::stage::pole::Pole;
use crate::stage::regions::candidates::{Candidates, PixelBox};

/// Share of a pole's pixels that things may have that were found before.
const MOST_KNOWN: f32 = 0.3;

/// Makes a candidate of each of `poles` of which little belongs to others yet.
pub fn adopt(poles: &[Pole], out: &mut Candidates) {
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
        if known as f32 > MOST_KNOWN * area as f32 {
            continue;
        }
        let id = out.first + out.boxes.len() as u32;
        let mut bounds = PixelBox::NONE;
        for (y, columns) in rows() {
            let (x0, row) = (columns.start, &mut out.ids.row_mut(y)[columns]);
            for (i, pixel) in row.iter_mut().enumerate() {
                if *pixel < out.first {
                    *pixel = id;
                    bounds.add(x0 + i, y, 1);
                }
            }
        }
        out.boxes.push(bounds);
    }
}
