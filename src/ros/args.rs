//! The ROS 2 part of a command line: `--ros-args … --`.
//!
//! Inside these sections every flag must be one that rcl knows; everything
//! outside belongs to the program and is handed back untouched.

use std::path::PathBuf;

use thiserror::Error;

use crate::config::Config;
use crate::ros::names::{NameError, Names, Remap, RemapKind};
use crate::ros::params::{self, Assignment, ParamsError};
use crate::ros::qos::QosOverrides;

/// A ROS 2 argument that cannot be taken.
#[derive(Debug, Error)]
pub enum ArgsError {
    /// rcl knows no such flag.
    #[error(
        "'{argument}' is no ROS 2 argument (inside --ros-args are allowed: -r/--remap, -p/--param, \
         --params-file, -e/--enclave, --log-level, --log-config-file, --log-file-name, \
         --{{enable,disable}}-{{stdout,rosout,external-lib}}-logs; '--' ends the section)"
    )]
    Unknown {
        /// The argument.
        argument: String,
    },
    /// A flag at the end of the line or section.
    #[error("{flag} wants {wanted} behind it")]
    Incomplete {
        /// The flag.
        flag: String,
        /// What it takes.
        wanted: &'static str,
    },
    /// A value of the wrong form.
    #[error("{flag} {value}: {reason}")]
    Malformed {
        /// The flag.
        flag: String,
        /// What stood behind it.
        value: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A remap rule or node name against the naming rules.
    #[error("remapping: {0}")]
    Name(#[from] NameError),
    /// A parameter or parameter file.
    #[error(transparent)]
    Params(#[from] ParamsError),
}

/// Severity of log messages, as in rcutils.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// For developers.
    Debug,
    /// Normal operation.
    Info,
    /// Worth a look.
    Warn,
    /// Something does not work.
    Error,
    /// Nothing works.
    Fatal,
}

/// What is logged, and where to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogArgs {
    /// Threshold of all loggers that are not named.
    pub level: Option<Severity>,
    /// Thresholds by logger name.
    pub loggers: Vec<(String, Severity)>,
    /// To the console.
    pub stdout: bool,
    /// To `/rosout`.
    pub rosout: bool,
}

impl Default for LogArgs {
    fn default() -> Self {
        Self { level: None, loggers: Vec::new(), stdout: true, rosout: true }
    }
}

impl LogArgs {
    /// The threshold of the logger `name`: its own, else that of the longest
    /// named ancestor (`a` of `a.b`), else the common one.
    pub fn threshold(&self, name: &str) -> Severity {
        let covers = |parent: &str| {
            name.strip_prefix(parent).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        self.loggers
            .iter()
            .rev()
            .filter(|(parent, _)| covers(parent))
            .max_by_key(|(parent, _)| parent.len())
            .map_or(self.level.unwrap_or(Severity::Info), |&(_, level)| level)
    }
}

/// Everything said between `--ros-args` and `--`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RosArgs {
    /// Remap rules in their order.
    pub remaps: Vec<Remap>,
    /// Parameters of `-p` and `--params-file` in their order.
    pub parameters: Vec<Assignment>,
    /// Security enclave.
    pub enclave: Option<String>,
    /// Logging.
    pub log: LogArgs,
}

impl RosArgs {
    /// Splits a command line (without the program's name) into its ROS 2 part
    /// and the rest. Parameter files are read at once.
    ///
    /// # Errors
    /// For what rcl refuses as well: unknown flags inside a section, missing
    /// values, malformed rules, files that cannot be read.
    pub fn split(
        arguments: impl IntoIterator<Item = String>,
    ) -> Result<(Self, Vec<String>), ArgsError> {
        let (mut ros, mut rest) = (Self::default(), Vec::new());
        let mut inside = false;
        let mut arguments = arguments.into_iter();
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--ros-args" => inside = true,
                "--" if inside => inside = false,
                _ if inside => ros.take(argument, &mut arguments)?,
                _ => rest.push(argument),
            }
        }
        Ok((ros, rest))
    }

    fn take(
        &mut self,
        argument: String,
        more: &mut impl Iterator<Item = String>,
    ) -> Result<(), ArgsError> {
        // rcl takes `--flag value` alone, no `--flag=value`.
        let mut value = |wanted| match more.next() {
            Some(value) if value != "--" && value != "--ros-args" => Ok(value),
            _ => Err(ArgsError::Incomplete { flag: argument.clone(), wanted }),
        };
        let malformed = |value: &str, reason: &str| ArgsError::Malformed {
            flag: argument.clone(),
            value: value.to_owned(),
            reason: reason.to_owned(),
        };
        match argument.as_str() {
            "-r" | "--remap" => {
                let rule = value("FROM:=TO")?;
                self.remaps.push(remap(&rule).map_err(|reason| malformed(&rule, reason))?);
            }
            "-p" | "--param" => {
                let rule = value("NAME:=VALUE")?;
                self.parameters
                    .push(parameter(&argument, &rule).map_err(|e| malformed(&rule, &e))?);
            }
            "--params-file" => {
                let file = PathBuf::from(value("a file")?);
                self.parameters.extend(params::read_file(&file)?);
            }
            "-e" | "--enclave" => self.enclave = Some(value("an enclave")?),
            "--log-level" => {
                let rule = value("[LOGGER:=]LEVEL")?;
                let (logger, level) = match rule.split_once(":=") {
                    Some((logger, level)) => (Some(logger), level),
                    None => (None, rule.as_str()),
                };
                let level = severity(level).ok_or_else(|| {
                    malformed(&rule, "the level must be debug, info, warn, error or fatal")
                })?;
                match logger {
                    None => self.log.level = Some(level),
                    Some("") => return Err(malformed(&rule, "the logger's name is empty")),
                    Some(logger) => self.log.loggers.push((logger.to_owned(), level)),
                }
            }
            // Settings of the spdlog backend, which this node does not have.
            "--log-config-file" | "--log-file-name" => drop(value("a file")?),
            "--enable-stdout-logs" => self.log.stdout = true,
            "--disable-stdout-logs" => self.log.stdout = false,
            "--enable-rosout-logs" => self.log.rosout = true,
            "--disable-rosout-logs" => self.log.rosout = false,
            "--enable-external-lib-logs" | "--disable-external-lib-logs" => {}
            _ => return Err(ArgsError::Unknown { argument }),
        }
        Ok(())
    }

    /// The node's names under the remap rules.
    ///
    /// # Errors
    /// When a rule breaks the naming rules.
    pub fn names(&self, namespace: &str, node: &str) -> Result<Names, ArgsError> {
        Ok(Names::new(namespace, node, &self.remaps)?)
    }

    /// `base` with the parameters for the node of these names, and warnings.
    ///
    /// # Errors
    /// With file or argument, parameter, and what is allowed.
    pub fn config(&self, base: &Config, names: &Names) -> Result<(Config, Vec<String>), ArgsError> {
        Ok(params::apply(base, &self.parameters, &names.full_name())?)
    }

    /// The `qos_overrides` for the node of these names.
    ///
    /// # Errors
    /// With file or argument, and what is allowed.
    pub fn qos_overrides(&self, names: &Names) -> Result<QosOverrides, ArgsError> {
        Ok(QosOverrides::new(&self.parameters, &names.full_name())?)
    }
}

fn remap(rule: &str) -> Result<Remap, &'static str> {
    let (from, to) = rule.split_once(":=").ok_or("FROM:=TO is wanted")?;
    if from.is_empty() || to.is_empty() {
        return Err("FROM:=TO is wanted, neither side empty");
    }
    // The node prefix ends at the first colon that is not part of `://`.
    let (node, from) = match from.split_once(':') {
        Some((_, rest)) if rest.starts_with("//") => (None, from),
        Some((node, rest)) => (Some(node), rest),
        None => (None, from),
    };
    if node.is_some_and(str::is_empty) || from.is_empty() {
        return Err("NODE:FROM:=TO is wanted, no part empty");
    }
    let (kind, from) = match from {
        "__ns" => (RemapKind::Namespace, ""),
        "__node" | "__name" => (RemapKind::Node, ""),
        _ => match (from.strip_prefix("rostopic://"), from.strip_prefix("rosservice://")) {
            (Some(topic), _) => (RemapKind::Topic, topic),
            (_, Some(service)) => (RemapKind::Service, service),
            _ => (RemapKind::Any, from),
        },
    };
    Ok(Remap { node: node.map(str::to_owned), kind, from: from.to_owned(), to: to.to_owned() })
}

fn parameter(flag: &str, rule: &str) -> Result<Assignment, String> {
    let (name, text) = rule.split_once(":=").ok_or("NAME:=VALUE is wanted")?;
    let (node, name) = name.split_once(':').unwrap_or(("/**", name));
    if node.is_empty() || name.is_empty() {
        return Err("NAME:=VALUE is wanted, no part empty".into());
    }
    Ok(Assignment {
        origin: format!("{flag} {rule}"),
        node: node.to_owned(),
        name: name.to_owned(),
        value: params::scalar(text)?,
        strict: true,
    })
}

fn severity(name: &str) -> Option<Severity> {
    match name.to_ascii_lowercase().as_str() {
        "debug" => Some(Severity::Debug),
        "info" => Some(Severity::Info),
        "warn" | "warning" => Some(Severity::Warn),
        "error" => Some(Severity::Error),
        "fatal" => Some(Severity::Fatal),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn split(line: &str) -> Result<(RosArgs, Vec<String>), ArgsError> {
        RosArgs::split(line.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn only_what_stands_between_the_marks_is_taken() {
        let (ros, rest) = split(
            "--fast -r x --ros-args -r a:=b -- -p keep --ros-args -p stereo.p1:=3 -e /enclave",
        )
        .unwrap();
        assert_eq!(rest, ["--fast", "-r", "x", "-p", "keep"]);
        assert_eq!(ros.remaps.len(), 1);
        assert_eq!(
            (ros.parameters[0].name.as_str(), &ros.parameters[0].value),
            ("stereo.p1", &json!(3))
        );
        assert_eq!(ros.enclave.as_deref(), Some("/enclave"));
    }

    #[test]
    fn the_first_namespace_wins_and_node_rules_are_for_their_node() {
        let (ros, _) = split(
            "--ros-args -r __ns:=/robot -r __ns:=/late -r __node:=eye -r other:left/image_rect:=/no \
             -r eye:left/image_rect:=/cam/left",
        )
        .unwrap();
        let names = ros.names("/", "salient_stereo").unwrap();
        assert_eq!(names.full_name(), "/robot/eye");
        assert_eq!(names.topic("left/image_rect").unwrap(), "/cam/left");
        assert_eq!(names.topic("right/image_rect").unwrap(), "/robot/right/image_rect");
    }

    #[test]
    fn parameters_are_taken_in_order_with_their_yaml_types() {
        let (ros, _) = split(
            "--ros-args -p depth.max:=40 -p depth.max:=50.5 -p other:depth.max:=1.0 \
             -p /salient_stereo:saliency.mode:=full_frame -p rectify:=true",
        )
        .unwrap();
        let names = ros.names("/", "salient_stereo").unwrap();
        let (config, warnings) = ros.config(&Config::default(), &names).unwrap();
        assert_eq!(config.depth.max, 50.5);
        assert!(config.rectify && warnings.is_empty());
        assert_eq!(config.value("saliency.mode").unwrap(), json!("full_frame"));
    }

    #[test]
    fn a_bad_parameter_is_named_with_its_argument_and_range() {
        let (ros, _) = split("--ros-args -p saliency.threshold:=7.0").unwrap();
        let names = ros.names("/", "salient_stereo").unwrap();
        let text = ros.config(&Config::default(), &names).unwrap_err().to_string();
        assert!(text.contains("-p saliency.threshold:=7.0") && text.contains("[0, 1]"), "{text}");
        let (ros, _) = split("--ros-args -p saliency.treshold:=0.7").unwrap();
        let text = ros.config(&Config::default(), &names).unwrap_err().to_string();
        assert!(text.contains("saliency.threshold"), "{text}");
    }

    #[test]
    fn what_rcl_refuses_is_refused() {
        for line in [
            "--ros-args --fast",
            "--ros-args stray",
            "--ros-args -r",
            "--ros-args -r --",
            "--ros-args -r a",
            "--ros-args -r a:=",
            "--ros-args -p :=1",
            "--ros-args -p a",
            "--ros-args --log-level loud",
            "--ros-args --params-file /nowhere/at/all.yaml",
        ] {
            assert!(split(line).is_err(), "{line}");
        }
    }

    #[test]
    fn logging_is_set_per_logger() {
        let (ros, _) = split(
            "--ros-args --log-level warn --log-level robot:=DEBUG --log-level robot.eye:=error \
             --disable-rosout-logs --enable-external-lib-logs --log-file-name x",
        )
        .unwrap();
        assert_eq!(ros.log.threshold("salient_stereo"), Severity::Warn);
        assert_eq!(ros.log.threshold("robot.nose"), Severity::Debug);
        assert_eq!(ros.log.threshold("robot.eye"), Severity::Error);
        assert_eq!(ros.log.threshold("robotics"), Severity::Warn);
        assert!(ros.log.stdout && !ros.log.rosout);
    }
}
