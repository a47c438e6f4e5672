//! The integration tests: one crate, so that they link once. The modules are
//! in `tests/it/`.

mod it {
    #[cfg(feature = "tool")]
    mod bag;
    #[cfg(feature = "tool")]
    mod dataset;
    mod depth;
    #[cfg(feature = "tool")]
    mod doctor;
    #[cfg(feature = "tool")]
    mod domain;
    mod ego;
    #[cfg(feature = "tool")]
    mod evaluate;
    #[cfg(feature = "tool")]
    mod evaluation;
    #[cfg(feature = "tool")]
    mod faulty;
    #[cfg(feature = "tool")]
    mod install;
    #[cfg(feature = "tool")]
    mod interop;
    #[cfg(feature = "tool")]
    mod live;
    #[cfg(feature = "tool")]
    mod metric;
    mod on_plane;
    #[cfg(feature = "tool")]
    mod params;
    #[cfg(feature = "tool")]
    mod picture;
    #[cfg(feature = "tool")]
    mod pipeline;
    mod pole;
    mod preprocess;
    mod reference;
    mod regions;
    #[cfg(feature = "tool")]
    mod replay;
    #[cfg(feature = "tool")]
    mod report;
    mod roi;
    mod saliency;
    mod scene;
    mod standing;
    mod stereo;
    mod sync;
    #[cfg(feature = "tool")]
    mod synthetic;
    mod table;
    mod track;
    #[cfg(feature = "tool")]
    mod vectors;
}
