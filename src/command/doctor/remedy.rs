//! What to do about a frame that could not be used.

/// The fix for a reason for which frames were dropped; empty when the reason
/// says it itself.
///
/// The reasons are the texts of `ConvertError`, `CalibrationError` and
/// `CdrError`; tests hold the two together.
pub fn remedy(reason: &str) -> &'static str {
    const REMEDIES: &[(&str, &str)] = &[
        (
            "unknown image encoding",
            "let the driver deliver one of these encodings, or convert the images with image_proc",
        ),
        (
            "a stereo pair has one size",
            "set both cameras to the same resolution, binning and region of interest",
        ),
        (
            "but its camera info describes",
            "calibrate at the resolution of the images, or let the driver set binning and region of interest in camera_info",
        ),
        (
            "image payload is",
            "the messages are inconsistent: correct height, width, step or encoding in the driver",
        ),
        ("image step is", "the messages are inconsistent: correct step or encoding in the driver"),
        ("image size is", "the messages are inconsistent: correct height and width in the driver"),
        (
            "needs an even",
            "let the driver deliver images of even width and height, or another encoding",
        ),
        (
            "compressed image is neither",
            "let the driver compress to JPEG or PNG; video streams are not read",
        ),
        (
            "cannot be decoded",
            "the compressed data is damaged: look at the recorder or the network",
        ),
        (
            "the baseline is negative",
            "exchange the left and the right topics, or correct P[3] of the right camera info (it is -f*B)",
        ),
        (
            "the baseline is zero",
            "calibrate the two cameras together (camera_calibration), or set calibration.baseline_override to the distance of the lenses in metres",
        ),
        ("do not hold this message", "sender and receiver have different definitions of the type"),
        ("chunk", "the file is damaged: mcap recover IN -o OUT saves what can be read"),
        ("behind the break", "the recorder was cut off; everything before is read"),
    ];
    REMEDIES.iter().find(|(part, _)| reason.contains(part)).map_or("", |(_, fix)| fix)
}
