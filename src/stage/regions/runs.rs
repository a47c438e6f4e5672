//! Runs of one id in a row.

use std::ops::Range;

/// The first run from place `from` on of an id that is not 0.
#[inline(always)]
pub fn run(ids: &[u32], from: usize) -> Option<(u32, Range<usize>)> {
    let start = same(ids, from, 0);
    let id = *ids.get(start)?;
    Some((id, start..same(ids, start, id)))
}

/// The first place from `from` on that does not have this id.
#[inline(always)]
fn same(ids: &[u32], mut from: usize, id: u32) -> usize {
    while let Some(group) = ids[from..].first_chunk::<8>() {
        let mut others = 0;
        for other in group {
            others |= other ^ id;
        }
        if others != 0 {
            break;
        }
        from += group.len();
    }
    from + ids[from..].iter().take_while(|other| **other == id).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_end_where_the_id_changes() {
        let ids = [[0; 11].as_slice(), &[3; 9], &[4; 1], &[0; 2], &[4; 17]].concat();
        let mut found = Vec::new();
        let mut next = 0;
        while let Some((id, cells)) = run(&ids, next) {
            next = cells.end;
            found.push((id, cells));
        }
        assert_eq!(found, [(3, 11..20), (4, 20..21), (4, 23..40)]);
    }
}
