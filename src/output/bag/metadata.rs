//! What rosbag2 wants to know about a bag: `metadata.yaml` and the record
//! `rosbag2`, both in version 9 (ROS 2 Jazzy).

use std::fmt::Write as _;

/// Name of the file in a bag folder.
pub const FILE_NAME: &str = "metadata.yaml";

/// The quality of service under which players offer every topic again:
/// reliable, as a reliable writer serves any reader.
pub const OFFERED_QOS: &str = "\
- history: keep_last
  depth: 5
  reliability: reliable
  durability: volatile
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
";

/// One topic of a written bag.
#[derive(Clone, Debug)]
pub struct TopicSummary {
    /// Topic name.
    pub name: String,
    /// As `pkg/msg/Type`.
    pub type_name: String,
    /// RIHS01 hash of the type.
    pub type_hash: String,
    /// Messages written.
    pub messages: u64,
}

/// What a written bag holds.
pub struct Summary<'a> {
    /// Name of the one file; `None` inside the file itself, whose bytes must not
    /// depend on its name (rosbag2 fills it in).
    pub file_name: Option<String>,
    /// Its topics, in the order in which they were added.
    pub topics: &'a [TopicSummary],
    /// First and last log time, nanoseconds.
    pub bounds: (u64, u64),
}

impl Summary<'_> {
    /// The text of `metadata.yaml`.
    pub fn file(&self) -> String {
        format!("rosbag2_bagfile_information:\n{}", self.fields("  "))
    }

    /// The fields, each line after `indent`.
    pub fn fields(&self, indent: &str) -> String {
        let (start, end) = self.bounds;
        let duration = end - start;
        let messages: u64 = self.topics.iter().map(|topic| topic.messages).sum();
        let (paths, files) = match &self.file_name {
            None => ("  []".to_owned(), "  []".to_owned()),
            Some(name) => {
                let name = quoted(name);
                let file = format!(
                    "\
- path: {name}
  starting_time:
    nanoseconds_since_epoch: {start}
  duration:
    nanoseconds: {duration}
  message_count: {messages}
"
                );
                (format!("  - {name}"), indented(&file, "  "))
            }
        };
        let mut topics = String::new();
        for topic in self.topics {
            // Writing into a String cannot fail.
            let _ = write!(
                topics,
                "  - topic_metadata:
      name: {}
      type: {}
      serialization_format: cdr
      offered_qos_profiles:
{}
      type_description_hash: {}
    message_count: {}
",
                quoted(&topic.name),
                topic.type_name,
                indented(OFFERED_QOS, "        "),
                topic.type_hash,
                topic.messages
            );
        }
        if topics.is_empty() {
            topics.push_str("  []\n");
        }
        let text = format!(
            "\
version: 9
storage_identifier: mcap
duration:
  nanoseconds: {duration}
starting_time:
  nanoseconds_since_epoch: {start}
message_count: {messages}
topics_with_message_count:
{topics}compression_format: \"\"
compression_mode: \"\"
relative_file_paths:
{paths}
files:
{files}
custom_data: ~
ros_distro: jazzy
"
        );
        let mut text = indented(&text, indent);
        text.push('\n');
        text
    }
}

/// A double-quoted YAML scalar: JSON's escapes are YAML's.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn indented(text: &str, indent: &str) -> String {
    let lines: Vec<String> = text.lines().map(|line| format!("{indent}{line}")).collect();
    lines.join("\n")
}
