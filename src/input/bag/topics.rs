//! Which topics of a bag are the stereo pair.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::error::BagError;
use super::read::TopicInfo;
use crate::config::{Config, ImageTransport, Input};

const IMAGE: &str = "sensor_msgs/msg/Image";
const COMPRESSED_IMAGE: &str = "sensor_msgs/msg/CompressedImage";
const CAMERA_INFO: &str = "sensor_msgs/msg/CameraInfo";

/// Topics by name; what is not named is looked for.
///
/// An image topic may be named with or without `/compressed`, camera infos are
/// expected beside their images, and truth beside the cameras.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BagTopics {
    /// Left images, or the images that hold both views.
    pub left: Option<String>,
    /// Right images.
    pub right: Option<String>,
    /// Camera infos of the left camera.
    pub left_info: Option<String>,
    /// Camera infos of the right camera.
    pub right_info: Option<String>,
    /// True disparity as 16-bit PNG: value / 256 pixels, 0 unknown.
    pub true_disparity: Option<String>,
    /// True object ids as 8- or 16-bit PNG, 0 background.
    pub true_objects: Option<String>,
}

/// A topic of images.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageTopic {
    /// Full name.
    pub name: String,
    /// `sensor_msgs/CompressedImage` instead of `sensor_msgs/Image`.
    pub compressed: bool,
}

/// The topics that are read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selection {
    /// Left images, or the images that hold both views.
    pub left: ImageTopic,
    /// Right images, unless `left` holds both views.
    pub right: Option<ImageTopic>,
    /// Camera infos, left and right, where the bag has them.
    pub infos: [Option<String>; 2],
    /// Names under which the camera infos were looked for.
    pub info_names: [String; 2],
    /// True disparity.
    pub true_disparity: Option<String>,
    /// True object ids.
    pub true_objects: Option<String>,
}

/// Looks for topics in one bag.
pub struct Finder<'a> {
    /// The bag, for messages.
    pub path: &'a Path,
    /// What it has.
    pub topics: &'a BTreeMap<String, TopicInfo>,
    /// What is read, and how.
    pub config: &'a Config,
}

impl Finder<'_> {
    /// The stereo pair of the bag.
    ///
    /// # Errors
    /// When there is none, or several, or one of the wrong types.
    pub fn choose(&self, wanted: &BagTopics) -> Result<Selection, BagError> {
        let side_by_side = self.config.input == Input::SideBySide;
        let (left, right, namespace) = match &wanted.left {
            Some(left) => {
                let left = self.image(left)?;
                let right = match (&wanted.right, side_by_side) {
                    (_, true) => None,
                    (Some(right), _) => Some(self.image(right)?),
                    (None, _) => Some(self.image(&other_side(base(&left.name)))?),
                };
                let folder = parent(base(&left.name));
                let namespace = if side_by_side { folder } else { parent(folder) };
                let namespace = namespace.to_owned();
                (left, right, namespace)
            }
            None if side_by_side => self.find_one()?,
            None => self.find_two(wanted.right.as_deref())?,
        };
        let info_name = |image: &ImageTopic| format!("{}/camera_info", parent(base(&image.name)));
        let beside = match &right {
            Some(right) => [info_name(&left), info_name(right)],
            None => ["left", "right"].map(|side| format!("{namespace}/{side}/camera_info")),
        };
        let [left_beside, right_beside] = beside;
        let info_names = [
            wanted.left_info.as_deref().map_or(left_beside, absolute),
            wanted.right_info.as_deref().map_or(right_beside, absolute),
        ];
        let mut infos = [None, None];
        for (info, name) in infos.iter_mut().zip(&info_names) {
            if self.topics.contains_key(name) {
                self.check(name, CAMERA_INFO)?;
                *info = Some(name.clone());
            }
        }
        Ok(Selection {
            left,
            right,
            infos,
            info_names,
            true_disparity: self.truth(
                wanted.true_disparity.as_deref(),
                &namespace,
                "disparity",
            )?,
            true_objects: self.truth(wanted.true_objects.as_deref(), &namespace, "objects")?,
        })
    }

    /// Names of the images that are looked for, the usual one first.
    fn image_names(&self) -> &'static [&'static str] {
        if self.config.rectify || self.config.input == Input::SideBySide {
            &["image_raw", "image_color"]
        } else {
            &["image_rect", "image_rect_color"]
        }
    }

    /// `left/image_rect` and `right/image_rect` under one namespace.
    fn find_two(
        &self,
        right: Option<&str>,
    ) -> Result<(ImageTopic, Option<ImageTopic>, String), BagError> {
        for name in self.image_names() {
            let suffix = format!("/left/{name}");
            let found = self.namespaces(&suffix);
            let whole: Vec<&str> = found
                .iter()
                .map(String::as_str)
                .filter(|namespace| {
                    let other = format!("{namespace}/right/{name}");
                    right.is_some() || self.has_image(&other)
                })
                .collect();
            let Some(namespace) = self.only_one(&whole)? else { continue };
            let left = self.image(&format!("{namespace}{suffix}"))?;
            let other = format!("{namespace}/right/{name}");
            let right = self.image(right.unwrap_or(&other))?;
            return Ok((left, Some(right), namespace.to_owned()));
        }
        let name = self.image_names()[0];
        Err(self.no_images(format!(
            "left/{name} and right/{name} (or …/compressed) under one namespace are needed"
        )))
    }

    /// `image_raw` that is not one of a left or right camera.
    fn find_one(&self) -> Result<(ImageTopic, Option<ImageTopic>, String), BagError> {
        for name in self.image_names() {
            let suffix = format!("/{name}");
            let found = self.namespaces(&suffix);
            let whole: Vec<&str> = found
                .iter()
                .map(String::as_str)
                .filter(|namespace| !namespace.ends_with("/left") && !namespace.ends_with("/right"))
                .collect();
            if let Some(namespace) = self.only_one(&whole)? {
                let image = self.image(&format!("{namespace}{suffix}"))?;
                return Ok((image, None, namespace.to_owned()));
            }
        }
        Err(self.no_images(
            "with input side_by_side, an image_raw (or image_raw/compressed) that holds both views is needed".to_owned(),
        ))
    }

    /// What stands before `suffix` in the names of image topics.
    fn namespaces(&self, suffix: &str) -> BTreeSet<String> {
        self.topics
            .keys()
            .filter_map(|topic| base(topic).strip_suffix(suffix))
            .map(str::to_owned)
            .filter(|namespace| self.has_image(&format!("{namespace}{suffix}")))
            .collect()
    }

    fn only_one<'n>(&self, namespaces: &[&'n str]) -> Result<Option<&'n str>, BagError> {
        match namespaces {
            [] => Ok(None),
            [only] => Ok(Some(only)),
            // The root namespace is the default of the node, too.
            several => match several.iter().find(|namespace| namespace.is_empty()) {
                Some(root) => Ok(Some(root)),
                None => Err(BagError::Ambiguous {
                    path: self.path.to_owned(),
                    namespaces: several.join(", "),
                }),
            },
        }
    }

    fn has_image(&self, name: &str) -> bool {
        [name.to_owned(), format!("{name}/compressed")].iter().any(|name| self.has_messages(name))
    }

    fn has_messages(&self, name: &str) -> bool {
        self.topics.get(name).is_some_and(|topic| topic.messages > 0)
    }

    /// The image topic `name`, raw or compressed: as the parameter says when
    /// the bag has both.
    fn image(&self, name: &str) -> Result<ImageTopic, BagError> {
        let name = absolute(name);
        let raw = base(&name).to_owned();
        let compressed = format!("{raw}/compressed");
        let (raw, compressed) = (
            ImageTopic { name: raw, compressed: false },
            ImageTopic { name: compressed, compressed: true },
        );
        // A name with /compressed asks for that one.
        let compressed_first =
            name == compressed.name || self.config.image_transport == ImageTransport::Compressed;
        let order = if compressed_first { [compressed, raw] } else { [raw, compressed] };
        let with_messages = order.iter().find(|topic| self.has_messages(&topic.name));
        let any = with_messages
            .or_else(|| order.iter().find(|topic| self.topics.contains_key(&topic.name)));
        let Some(topic) = any else {
            return Err(BagError::NoTopic {
                path: self.path.to_owned(),
                topic: name,
                topics: self.listed(),
            });
        };
        let mut topic = topic.clone();
        if self.topics.get(&topic.name).is_some_and(|info| info.type_name == COMPRESSED_IMAGE) {
            // Some name their compressed topics freely.
            topic.compressed = true;
        }
        self.check(&topic.name, if topic.compressed { COMPRESSED_IMAGE } else { IMAGE })?;
        Ok(topic)
    }

    fn truth(
        &self,
        wanted: Option<&str>,
        namespace: &str,
        what: &str,
    ) -> Result<Option<String>, BagError> {
        if let Some(name) = wanted {
            return self.image(name).map(|topic| Some(topic.name));
        }
        let names =
            [format!("{namespace}/truth/{what}/compressed"), format!("/truth/{what}/compressed")];
        let Some(name) = names.into_iter().find(|name| self.topics.contains_key(name)) else {
            return Ok(None);
        };
        self.check(&name, COMPRESSED_IMAGE)?;
        Ok(Some(name))
    }

    fn check(&self, topic: &str, wanted: &str) -> Result<(), BagError> {
        let Some(info) = self.topics.get(topic) else { return Ok(()) };
        let (path, topic) = (self.path.to_owned(), topic.to_owned());
        if info.message_encoding != "cdr" {
            let encoding = info.message_encoding.clone();
            return Err(BagError::Encoding { path, topic, encoding });
        }
        if info.type_name != wanted {
            let (found, wanted) = (info.type_name.clone(), wanted.to_owned());
            return Err(BagError::TopicType { path, topic, found, wanted });
        }
        Ok(())
    }

    fn no_images(&self, wanted: String) -> BagError {
        let any = |suffix: &str| self.topics.keys().any(|topic| base(topic).ends_with(suffix));
        let hint = if !self.config.rectify && any("/left/image_raw") && any("/right/image_raw") {
            "; it has unrectified images: set rectify to true"
        } else if self.config.rectify && any("/left/image_rect") && any("/right/image_rect") {
            "; it has rectified images: set rectify to false"
        } else if any("/left/image_rect") || any("/left/image_raw") {
            "; the right images are missing"
        } else if any("/right/image_rect") || any("/right/image_raw") {
            "; the left images are missing"
        } else if self
            .topics
            .values()
            .any(|t| t.type_name == IMAGE || t.type_name == COMPRESSED_IMAGE)
        {
            "; if two of them are the pair, name them"
        } else {
            ""
        };
        BagError::NoImages {
            path: self.path.to_owned(),
            wanted,
            topics: self.listed(),
            hint: hint.to_owned(),
        }
    }

    /// All topics with their types, for messages.
    fn listed(&self) -> String {
        listed(self.topics)
    }
}

/// All topics with their types, for messages; the first fifty of many.
pub fn listed(topics: &BTreeMap<String, TopicInfo>) -> String {
    const MOST: usize = 50;
    if topics.is_empty() {
        return "none".to_owned();
    }
    let mut names: Vec<String> = topics
        .iter()
        .take(MOST)
        .map(|(name, info)| {
            let name = name.escape_debug();
            format!("{name} ({}, {} messages)", info.type_name.escape_debug(), info.messages)
        })
        .collect();
    if topics.len() > MOST {
        names.push(format!("and {} more", topics.len() - MOST));
    }
    names.join(", ")
}

/// The topic without the suffix of its transport.
fn base(topic: &str) -> &str {
    topic.strip_suffix("/compressed").unwrap_or(topic)
}

fn parent(topic: &str) -> &str {
    topic.rsplit_once('/').map_or("", |(parent, _)| parent)
}

fn absolute(topic: &str) -> String {
    if topic.starts_with('/') { topic.to_owned() } else { format!("/{topic}") }
}

/// The name of the other camera's topic: the last `left` becomes `right`.
fn other_side(left: &str) -> String {
    match left.rfind("left") {
        Some(at) => format!("{}right{}", &left[..at], &left[at + "left".len()..]),
        None => left.to_owned(),
    }
}
