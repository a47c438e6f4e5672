//! The data sets that are known by name.

use std::fmt;
use std::str::FromStr;

/// A data set, or a family of them with one layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DatasetKind {
    /// KITTI Stereo and Flow 2012.
    Kitti2012,
    /// KITTI Stereo and Flow 2015.
    Kitti2015,
    /// Middlebury Stereo, all years.
    Middlebury,
    /// MPI Sintel, stereo or flow.
    Sintel,
    /// Spring.
    Spring,
    /// DAVIS 2016 and 2017: videos with object masks.
    Davis,
    /// Photographs with masks of what is salient (DUTS and others).
    Saliency,
}

impl DatasetKind {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Kitti2012,
        Self::Kitti2015,
        Self::Middlebury,
        Self::Sintel,
        Self::Spring,
        Self::Davis,
        Self::Saliency,
    ];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Kitti2012 => "kitti2012",
            Self::Kitti2015 => "kitti2015",
            Self::Middlebury => "middlebury",
            Self::Sintel => "sintel",
            Self::Spring => "spring",
            Self::Davis => "davis",
            Self::Saliency => "saliency",
        }
    }
}

impl fmt::Display for DatasetKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for DatasetKind {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|kind| kind.name() == text).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("no data set '{text}'; there are {names}")
        })
    }
}
