//! What the environment variables of ROS 2 ask for. The crates below read none
//! of them.

use std::net::{IpAddr, Ipv4Addr};

use ros2_client::dds::ServiceMapping;
use thiserror::Error;

use crate::ros::security::{Demand, Enclave, SecurityError};

/// What is wrong with the environment.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum EnvironmentError {
    /// A variable with a value of no use.
    #[error("environment variable {name}={value}: {wanted}")]
    Value {
        /// The variable.
        name: &'static str,
        /// Its value.
        value: String,
        /// What it may be.
        wanted: &'static str,
    },
    /// Security is enforced and cannot be had.
    #[error(transparent)]
    Security(#[from] SecurityError),
}

/// What carries the messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Middleware {
    /// DDS, and how services travel on it.
    Dds(ServiceMapping),
    /// Zenoh, as `rmw_zenoh_cpp` speaks it.
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohSettings),
}

/// How a Zenoh session finds the others.
#[cfg(feature = "zenoh")]
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ZenohSettings {
    /// `ZENOH_SESSION_CONFIG_URI`: a JSON5 file in place of ROS's default.
    pub config_file: Option<std::path::PathBuf>,
    /// `ZENOH_CONFIG_OVERRIDE`: `KEY=VALUE;KEY=VALUE`, the values in JSON5.
    pub overrides: String,
}

/// Where to look for other nodes, and how to speak to them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Environment {
    /// Domain, 0..=232.
    pub domain_id: u16,
    /// True: DDS traffic on the loopback interface only.
    pub localhost: bool,
    /// What carries the messages.
    pub middleware: Middleware,
    /// Where identity and permissions come from; `None`: traffic is not secured.
    pub security: Option<Enclave>,
    /// What was asked for and cannot be had, for the log.
    pub notes: Vec<String>,
}

impl Environment {
    /// The environment of this process, which runs in `enclave` (`--enclave`).
    ///
    /// # Errors
    /// For a value of no use, and when security is enforced and cannot be had.
    pub fn of_process(enclave: Option<&str>) -> Result<Self, EnvironmentError> {
        let variable = |name| std::env::var(name).ok().filter(|value: &String| !value.is_empty());
        Self::from_variables(variable, enclave)
    }

    /// Loopback traffic on one domain, whatever the process environment says.
    pub fn localhost(domain_id: u16) -> Self {
        Self {
            domain_id,
            localhost: true,
            middleware: Middleware::Dds(ServiceMapping::Enhanced),
            security: None,
            notes: Vec::new(),
        }
    }

    /// The environment given by a look-up of variables.
    ///
    /// # Errors
    /// As [`Environment::of_process`].
    pub fn from_variables(
        variable: impl Fn(&'static str) -> Option<String>,
        enclave: Option<&str>,
    ) -> Result<Self, EnvironmentError> {
        let mut notes = Vec::new();
        let domain_id = match variable("ROS_DOMAIN_ID") {
            None => 0,
            Some(value) => {
                // Above 232 the port numbers of the domain leave their range.
                value.trim().parse().ok().filter(|id| *id <= 232).ok_or(
                    EnvironmentError::Value {
                        name: "ROS_DOMAIN_ID",
                        value,
                        wanted: "a whole number from 0 to 232 is wanted",
                    },
                )?
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
                    return Err(EnvironmentError::Value {
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
                    return Err(EnvironmentError::Value {
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
        let demand = demand(&variable, enclave)?;
        let middleware = match variable("RMW_IMPLEMENTATION").as_deref() {
            Some("rmw_cyclonedds_cpp") => Middleware::Dds(ServiceMapping::Cyclone),
            Some("rmw_zenoh_cpp") => zenoh(&variable)?,
            Some(other) if other != "rmw_fastrtps_cpp" && other != "rmw_fastrtps_dynamic_cpp" => {
                notes.push(format!(
                    "RMW_IMPLEMENTATION={other}: this node speaks DDS as rmw_fastrtps_cpp does"
                ));
                Middleware::Dds(ServiceMapping::Enhanced)
            }
            _ => Middleware::Dds(ServiceMapping::Enhanced),
        };
        #[cfg(feature = "zenoh")]
        if let (Middleware::Zenoh(_), Some(demand)) = (&middleware, &demand) {
            if demand.enforce {
                return Err(SecurityError::Zenoh.into());
            }
            notes.push(SecurityError::Zenoh.to_string());
        }
        let security = match (&middleware, demand) {
            (Middleware::Dds(_), Some(demand)) => demand.meet(&mut notes)?,
            _ => None,
        };
        Ok(Self { domain_id, localhost, middleware, security, notes })
    }

    /// The only networks to use; `None` for all.
    pub(crate) fn only_networks(&self) -> Option<[IpAddr; 1]> {
        self.localhost.then_some([IpAddr::V4(Ipv4Addr::LOCALHOST)])
    }

    /// Whether what a node sends to itself goes the way of its other messages.
    pub(crate) const fn echoes(&self) -> bool {
        match &self.middleware {
            // RustDDS sends to a loopback address only what is for others that
            // it has heard there.
            Middleware::Dds(_) => !self.localhost,
            // The session calls its own subscriptions, past all links: that
            // echo comes back whatever becomes of them.
            #[cfg(feature = "zenoh")]
            Middleware::Zenoh(_) => false,
        }
    }
}

/// What is asked for as to Zenoh.
#[cfg(feature = "zenoh")]
// As its twin below, which can fail.
#[allow(clippy::unnecessary_wraps)]
fn zenoh(
    variable: &impl Fn(&'static str) -> Option<String>,
) -> Result<Middleware, EnvironmentError> {
    Ok(Middleware::Zenoh(ZenohSettings {
        config_file: variable("ZENOH_SESSION_CONFIG_URI").map(Into::into),
        overrides: variable("ZENOH_CONFIG_OVERRIDE").unwrap_or_default(),
    }))
}

#[cfg(not(feature = "zenoh"))]
fn zenoh(_: &impl Fn(&'static str) -> Option<String>) -> Result<Middleware, EnvironmentError> {
    Err(EnvironmentError::Value {
        name: "RMW_IMPLEMENTATION",
        value: "rmw_zenoh_cpp".to_owned(),
        wanted: "this build speaks DDS only; build with `cargo build --release --features zenoh`, \
                 or name rmw_fastrtps_cpp or rmw_cyclonedds_cpp",
    })
}

/// What is asked for as to security; `None` when it is off.
fn demand(
    variable: &impl Fn(&'static str) -> Option<String>,
    enclave: Option<&str>,
) -> Result<Option<Demand>, EnvironmentError> {
    // rcl takes other spellings for "off" and for "Permissive". Whoever wrote
    // `1` or `enforce` meant the opposite, so they are refused here.
    let refused = |name, value, wanted| Err(EnvironmentError::Value { name, value, wanted });
    match variable("ROS_SECURITY_ENABLE") {
        None => return Ok(None),
        Some(value) => match value.as_str() {
            "false" => return Ok(None),
            "true" => {}
            _ => return refused("ROS_SECURITY_ENABLE", value, "true or false is wanted"),
        },
    }
    let enforce = match variable("ROS_SECURITY_STRATEGY") {
        None => false,
        Some(value) => match value.as_str() {
            "Enforce" => true,
            "Permissive" => false,
            _ => return refused("ROS_SECURITY_STRATEGY", value, "Enforce or Permissive is wanted"),
        },
    };
    Ok(Some(Demand {
        enforce,
        keystore: variable("ROS_SECURITY_KEYSTORE"),
        enclave: variable("ROS_SECURITY_ENCLAVE_OVERRIDE").or(enclave.map(str::to_owned)),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment(
        variables: &[(&'static str, &'static str)],
    ) -> Result<Environment, EnvironmentError> {
        let look_up = |name: &str| {
            variables.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned())
        };
        Environment::from_variables(look_up, None)
    }

    #[test]
    fn nothing_set_is_the_default_of_ros() {
        let env = environment(&[]).unwrap();
        assert_eq!((env.domain_id, env.localhost), (0, false));
        assert_eq!(env.middleware, Middleware::Dds(ServiceMapping::Enhanced));
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
        assert_eq!(env.middleware, Middleware::Dds(ServiceMapping::Cyclone));
        assert!(environment(&[("ROS_LOCALHOST_ONLY", "1")]).unwrap().localhost);
    }

    #[test]
    fn what_cannot_be_honoured_is_said() {
        let env = environment(&[
            ("ROS_STATIC_PEERS", "10.0.0.1"),
            ("ROS_SECURITY_ENABLE", "true"),
            ("RMW_IMPLEMENTATION", "rmw_connextdds"),
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
            &[("ROS_SECURITY_ENABLE", "1")],
            &[("ROS_SECURITY_ENABLE", "true"), ("ROS_SECURITY_STRATEGY", "enforce")],
        ] {
            let error = environment(variables).unwrap_err();
            assert!(error.to_string().contains(variables.last().unwrap().0), "{error}");
        }
    }

    #[test]
    fn enforced_security_is_had_or_nothing_starts() {
        let error = environment(&[
            ("ROS_SECURITY_ENABLE", "true"),
            ("ROS_SECURITY_STRATEGY", "Enforce"),
            ("ROS_SECURITY_KEYSTORE", "/no/such/keystore"),
        ])
        .unwrap_err();
        let named =
            if cfg!(feature = "security") { "/no/such/keystore" } else { "--features security" };
        assert!(error.to_string().contains(named), "{error}");
        let off = environment(&[
            ("ROS_SECURITY_ENABLE", "false"),
            ("ROS_SECURITY_STRATEGY", "Enforce"),
            ("ROS_SECURITY_KEYSTORE", "/no/such/keystore"),
        ]);
        assert_eq!(off.unwrap().security, None);
    }

    #[cfg(not(feature = "zenoh"))]
    #[test]
    fn a_build_without_zenoh_says_so() {
        let error = environment(&[("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")]).unwrap_err();
        assert!(error.to_string().contains("--features zenoh"), "{error}");
    }

    #[cfg(feature = "zenoh")]
    #[test]
    fn zenoh_is_chosen_with_its_settings_and_never_taken_for_secured() {
        let chosen = [
            ("RMW_IMPLEMENTATION", "rmw_zenoh_cpp"),
            ("ZENOH_SESSION_CONFIG_URI", "/etc/session.json5"),
            ("ZENOH_CONFIG_OVERRIDE", "mode=\"client\""),
            ("ROS_SECURITY_ENABLE", "true"),
        ];
        let Middleware::Zenoh(settings) = environment(&chosen[..3]).unwrap().middleware else {
            panic!("another middleware was chosen")
        };
        assert_eq!(settings.config_file.unwrap().to_str(), Some("/etc/session.json5"));
        assert_eq!(settings.overrides, "mode=\"client\"");
        let noted = environment(&chosen).unwrap();
        assert!(noted.security.is_none() && noted.notes[0].contains("Zenoh"));
        let enforced = [chosen[0], chosen[3], ("ROS_SECURITY_STRATEGY", "Enforce")];
        assert_eq!(environment(&enforced), Err(SecurityError::Zenoh.into()));
    }
}
