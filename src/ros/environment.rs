//! What the environment variables of ROS 2 ask for. The crates below read none
//! of them.

use std::net::{IpAddr, Ipv4Addr};

use ros2_client::ServiceMapping;
use thiserror::Error;

/// A variable with a value of no use.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("environment variable {name}={value}: {wanted}")]
pub struct EnvironmentError {
    /// The variable.
    pub name: &'static str,
    /// Its value.
    pub value: String,
    /// What it may be.
    pub wanted: &'static str,
}

/// Where to look for other nodes, and how to speak to them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Environment {
    /// DDS domain, 0..=232.
    pub domain_id: u16,
    /// True: traffic on the loopback interface only.
    pub localhost: bool,
    /// How services travel.
    pub service_mapping: ServiceMapping,
    /// What was asked for and cannot be had, for the log.
    pub notes: Vec<String>,
}

impl Environment {
    /// The environment of this process.
    ///
    /// # Errors
    /// For a value of no use, and when security is demanded.
    pub fn of_process() -> Result<Self, EnvironmentError> {
        Self::from_variables(|name| std::env::var(name).ok().filter(|value| !value.is_empty()))
    }

    /// Loopback traffic on one domain, whatever the process environment says.
    pub fn localhost(domain_id: u16) -> Self {
        Self {
            domain_id,
            localhost: true,
            service_mapping: ServiceMapping::Enhanced,
            notes: Vec::new(),
        }
    }

    /// The environment given by a look-up of variables.
    ///
    /// # Errors
    /// As [`Environment::of_process`].
    pub fn from_variables(
        variable: impl Fn(&'static str) -> Option<String>,
    ) -> Result<Self, EnvironmentError> {
        let mut notes = Vec::new();
        let domain_id = match variable("ROS_DOMAIN_ID") {
            None => 0,
            Some(value) => {
                // Above 232 the port numbers of the domain leave their range.
                value.trim().parse().ok().filter(|id| *id <= 232).ok_or(EnvironmentError {
                    name: "ROS_DOMAIN_ID",
                    value,
                    wanted: "a whole number from 0 to 232 is wanted",
                })?
            }
        };
        let mut localhost = false;
        if let Some(value) = variable("ROS_AUTOMATIC_DISCOVERY_RANGE") {
            match value.as_str() {
                "SUBNET" | "SYSTEM_DEFAULT" => {}
                "LOCALHOST" => localhost = true,
                "OFF" => {
                    localhost = true;
                    notes.push(
                        "ROS_AUTOMATIC_DISCOVERY_RANGE=OFF cannot be honoured: LOCALHOST is taken"
                            .to_owned(),
                    );
                }
                _ => {
                    return Err(EnvironmentError {
                        name: "ROS_AUTOMATIC_DISCOVERY_RANGE",
                        value,
                        wanted: "SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT is wanted",
                    });
                }
            }
        }
        // Deprecated, and still stronger than the range, as in Jazzy.
        if let Some(value) = variable("ROS_LOCALHOST_ONLY") {
            localhost = match value.as_str() {
                "1" => true,
                "0" => false,
                _ => {
                    return Err(EnvironmentError {
                        name: "ROS_LOCALHOST_ONLY",
                        value,
                        wanted: "0 or 1 is wanted",
                    });
                }
            };
        }
        if let Some(peers) = variable("ROS_STATIC_PEERS") {
            notes.push(format!(
                "ROS_STATIC_PEERS={peers} is not honoured: other hosts are found by multicast only"
            ));
        }
        if variable("ROS_SECURITY_ENABLE").as_deref() == Some("true") {
            if variable("ROS_SECURITY_STRATEGY").as_deref() == Some("Enforce") {
                return Err(EnvironmentError {
                    name: "ROS_SECURITY_STRATEGY",
                    value: "Enforce".to_owned(),
                    wanted: "this node has no DDS security; unset it or use Permissive",
                });
            }
            notes.push("ROS_SECURITY_ENABLE=true is not honoured: traffic is not secured".into());
        }
        let service_mapping = match variable("RMW_IMPLEMENTATION").as_deref() {
            Some("rmw_cyclonedds_cpp") => ServiceMapping::Cyclone,
            Some(other) if other != "rmw_fastrtps_cpp" && other != "rmw_fastrtps_dynamic_cpp" => {
                notes.push(format!(
                    "RMW_IMPLEMENTATION={other}: this node speaks DDS as rmw_fastrtps_cpp does"
                ));
                ServiceMapping::Enhanced
            }
            _ => ServiceMapping::Enhanced,
        };
        Ok(Self { domain_id, localhost, service_mapping, notes })
    }

    /// The only networks to use; `None` for all.
    pub(crate) fn only_networks(&self) -> Option<[IpAddr; 1]> {
        self.localhost.then_some([IpAddr::V4(Ipv4Addr::LOCALHOST)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment(
        variables: &'static [(&'static str, &'static str)],
    ) -> Result<Environment, EnvironmentError> {
        Environment::from_variables(|name| {
            variables.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn nothing_set_is_the_default_of_ros() {
        let env = environment(&[]).unwrap();
        assert_eq!((env.domain_id, env.localhost), (0, false));
        assert_eq!(env.service_mapping, ServiceMapping::Enhanced);
        assert!(env.notes.is_empty());
    }

    #[test]
    fn domain_range_and_mapping_are_read() {
        let env = environment(&[
            ("ROS_DOMAIN_ID", "42"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
            ("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp"),
        ])
        .unwrap();
        assert_eq!((env.domain_id, env.localhost), (42, true));
        assert_eq!(env.service_mapping, ServiceMapping::Cyclone);
        assert!(environment(&[("ROS_LOCALHOST_ONLY", "1")]).unwrap().localhost);
    }

    #[test]
    fn what_cannot_be_honoured_is_said() {
        let env = environment(&[
            ("ROS_STATIC_PEERS", "10.0.0.1"),
            ("ROS_SECURITY_ENABLE", "true"),
            ("RMW_IMPLEMENTATION", "rmw_zenoh_cpp"),
        ])
        .unwrap();
        assert_eq!(env.notes.len(), 3);
    }

    #[test]
    fn values_of_no_use_are_refused() {
        for variables in [
            &[("ROS_DOMAIN_ID", "233")] as &[_],
            &[("ROS_DOMAIN_ID", "x")],
            &[("ROS_AUTOMATIC_DISCOVERY_RANGE", "FAR")],
            &[("ROS_LOCALHOST_ONLY", "yes")],
            &[("ROS_SECURITY_ENABLE", "true"), ("ROS_SECURITY_STRATEGY", "Enforce")],
        ] {
            let error = Environment::from_variables(|name| {
                variables.iter().find(|(key, _)| *key == name).map(|(_, v)| (*v).to_owned())
            })
            .unwrap_err();
            assert!(error.to_string().contains(variables.last().unwrap().0), "{error}");
        }
    }
}
