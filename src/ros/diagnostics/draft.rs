//! One status of the `/diagnostics` message while it is being filled.

use std::fmt::Display;

use crate::ros::message::diagnostic_msgs::{DiagnosticStatus, KeyValue};

/// One status being filled.
pub(super) struct Draft {
    pub level: u8,
    pub message: String,
    /// The part of the message that nobody else logs.
    pub news: String,
    pub values: Vec<KeyValue>,
}

impl Draft {
    pub fn new() -> Self {
        Self {
            level: DiagnosticStatus::OK,
            message: String::new(),
            news: String::new(),
            values: Vec::new(),
        }
    }

    /// Says what is wrong; logged when the status becomes worse.
    pub fn say(&mut self, level: u8, message: impl Display) {
        let message = message.to_string();
        append(&mut self.news, &message);
        self.say_again(level, message);
    }

    /// Says what another place has logged already.
    pub fn say_again(&mut self, level: u8, message: impl Display) {
        self.level = self.level.max(level);
        append(&mut self.message, &message.to_string());
    }

    pub fn value(&mut self, key: impl Into<String>, value: impl Display) {
        self.values.push(KeyValue { key: key.into(), value: value.to_string() });
    }
}

fn append(text: &mut String, sentence: &str) {
    if !text.is_empty() {
        text.push_str("; ");
    }
    text.push_str(sentence);
}
