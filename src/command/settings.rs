//! The arguments that every command with a pipeline takes.

use std::path::PathBuf;

use clap::Args;
use serde_json::Value;

use crate::command::CommandError;
use crate::config::Config;
use crate::input::bag::{BagOptions, BagTopics};
use crate::ros::calibration::camera_info_from_url;
use crate::ros::params::{config_from_file, config_from_set};

/// Parameters from a file and from the command line.
#[derive(Clone, Debug, Default, Args)]
pub struct Settings {
    /// Parameter file in ROS 2 form (`/**: ros__parameters:`)
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Set one parameter, e.g. `--set saliency.threshold=0.4` (repeatable; wins over --config)
    #[arg(long = "set", value_name = "NAME=VALUE")]
    sets: Vec<String>,
    /// Worker threads; 0 takes all processors
    #[arg(long, value_name = "N")]
    threads: Option<i64>,
}

impl Settings {
    /// The parameters in force: `base`, then the file, then the command line.
    ///
    /// # Errors
    /// A file that cannot be read, an unknown name, or a value out of range.
    pub fn config(&self, base: Config) -> Result<Config, CommandError> {
        let mut config = base;
        if let Some(file) = &self.config {
            config = config_from_file(&config, file).map_err(usage)?;
        }
        for set in &self.sets {
            config = config_from_set(&config, set).map_err(usage)?;
        }
        if let Some(threads) = self.threads {
            config = config.with("threads", &Value::from(threads)).map_err(usage)?;
        }
        Ok(config)
    }
}

/// What to read of a bag: its topics, and the calibration files that replace
/// its camera infos (`camera_info.left_url`, `camera_info.right_url`).
///
/// # Errors
/// A calibration file that cannot be read.
pub fn bag_options(config: &Config, topics: BagTopics) -> Result<BagOptions, CommandError> {
    let info = |url: &str| match url {
        "" => Ok(None),
        url => camera_info_from_url(url).map(Some).map_err(usage),
    };
    let urls = &config.camera_info;
    let camera_infos = [info(&urls.left_url)?, info(&urls.right_url)?];
    Ok(BagOptions { topics, camera_infos, ..BagOptions::default() })
}

fn usage(error: impl std::fmt::Display) -> CommandError {
    CommandError::Usage(error.to_string())
}
