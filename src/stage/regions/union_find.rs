//! Disjoint sets over indices (Galler and Fischer 1964, with path halving).

/// Sets over `0..len`; the representative of a set is its smallest member, so
/// that numbering sets by representative numbers them in the order of creation.
#[derive(Debug, Default)]
pub struct UnionFind {
    parent: Vec<u32>,
}

impl UnionFind {
    /// Forgets all sets and keeps the buffer.
    pub fn clear(&mut self) {
        self.parent.clear();
    }

    /// Sets of one member each, `0..len`.
    pub fn reset(&mut self, len: usize) {
        self.parent.clear();
        self.parent.extend(0..len as u32);
    }

    /// Adds a set of one new member.
    pub fn push(&mut self) {
        self.parent.push(self.parent.len() as u32);
    }

    /// The representative of the set of `i`.
    pub fn find(&mut self, mut i: u32) -> u32 {
        loop {
            let parent = self.parent[i as usize];
            if parent == i {
                return i;
            }
            let grandparent = self.parent[parent as usize];
            self.parent[i as usize] = grandparent;
            i = grandparent;
        }
    }

    /// Makes one set of the sets of `a` and `b`.
    pub fn union(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        self.parent[high as usize] = low;
    }
}
