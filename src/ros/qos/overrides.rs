//! `qos_overrides./full/topic.{publisher,subscription}[_id].POLICY`: what a user
//! sets instead of the quality of service that the node would choose.

use rustdds::policy::{Durability, History, Reliability};
use rustdds::{Duration, QosPolicies, QosPolicyBuilder};
use serde_json::Value;

use super::limits;
use crate::ros::names::node_matches;
use crate::ros::params::{Assignment, ParamsError};

/// What the names of these parameters begin with.
pub const PREFIX: &str = "qos_overrides.";

/// Most messages that a topic may keep: images of megabytes stay payable.
const DEEPEST: i64 = 1000;

/// Which end of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// It is published.
    Publisher,
    /// It is subscribed to.
    Subscription,
}

/// All overrides for one node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QosOverrides {
    rules: Vec<Rule>,
}

#[derive(Clone, Debug, PartialEq)]
struct Rule {
    topic: String,
    role: Role,
    change: QosPolicies,
}

impl QosOverrides {
    /// The overrides among the parameters that are for the node `full_name`, in
    /// their order.
    ///
    /// # Errors
    /// For a name or value that means nothing, with its origin and what is allowed.
    pub fn new(assignments: &[Assignment], full_name: &str) -> Result<Self, ParamsError> {
        let mut rules = Vec::new();
        for assignment in assignments.iter().filter(|a| node_matches(&a.node, full_name)) {
            let Some(name) = assignment.name.strip_prefix(PREFIX) else { continue };
            let made = rule(name, &assignment.value);
            rules.push(made.map_err(|reason| ParamsError::Shape {
                origin: assignment.origin.clone(),
                reason: format!("{}: {reason}", assignment.name),
            })?);
        }
        Ok(Self { rules })
    }

    /// `qos` as it is to be for one end of the topic with this full name.
    #[must_use]
    pub fn apply(&self, topic: &str, role: Role, qos: &QosPolicies) -> QosPolicies {
        let rules = self.rules.iter().filter(|rule| rule.topic == topic && rule.role == role);
        rules.fold(qos.clone(), |qos, rule| qos.modify_by(&rule.change))
    }

    /// The topics that are named.
    pub fn topics(&self) -> impl Iterator<Item = &str> {
        self.rules.iter().map(|rule| rule.topic.as_str())
    }
}

fn rule(name: &str, value: &Value) -> Result<Rule, String> {
    let mut parts = name.rsplitn(3, '.');
    let (Some(policy), Some(end), Some(topic)) = (parts.next(), parts.next(), parts.next()) else {
        return Err("qos_overrides./full/topic.publisher.POLICY is wanted".into());
    };
    if !topic.starts_with('/') {
        return Err(format!("the topic's full name is wanted, '{topic}' is relative"));
    }
    let role = match end.split('_').next() {
        Some("publisher") => Role::Publisher,
        Some("subscription") => Role::Subscription,
        _ => return Err(format!("'{end}' is neither publisher nor subscription")),
    };
    Ok(Rule { topic: topic.to_owned(), role, change: change(policy, value)? })
}

/// The policies that replace those of the node.
fn change(policy: &str, value: &Value) -> Result<QosPolicies, String> {
    let none = QosPolicyBuilder::new();
    let changed = match (policy, value.as_str(), value.as_i64()) {
        (_, Some("system_default"), _) | ("history", Some("keep_last"), _) => none,
        ("reliability", Some("reliable"), _) => none.reliable(Duration::ZERO),
        ("reliability", Some("best_effort"), _) => none.reliability(Reliability::BestEffort),
        ("durability", Some("volatile"), _) => none.durability(Durability::Volatile),
        ("durability", Some("transient_local"), _) => none.durability(Durability::TransientLocal),
        ("depth", _, Some(depth)) if (1..=DEEPEST).contains(&depth) => {
            let depth = depth as i32;
            none.history(History::KeepLast { depth }).resource_limits(limits(depth))
        }
        ("reliability", ..) => return Err(wanted(value, "reliable or best_effort")),
        ("durability", ..) => return Err(wanted(value, "volatile or transient_local")),
        ("history", ..) => return Err(wanted(value, "keep_last")),
        ("depth", ..) => return Err(wanted(value, "a whole number from 1 to 1000")),
        _ => {
            return Err(format!(
                "there is no policy '{policy}': reliability, durability, history and depth can be set"
            ));
        }
    };
    Ok(changed.build())
}

fn wanted(value: &Value, allowed: &str) -> String {
    format!("{allowed} is wanted, not {value}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::params::parse;
    use crate::ros::qos;

    fn overrides(text: &str) -> Result<QosOverrides, ParamsError> {
        QosOverrides::new(&parse(text, "a.yaml").unwrap(), "/robot/eye")
    }

    const FILE: &str = "
/robot/eye:
  ros__parameters:
    lazy: true
    qos_overrides:
      /robot/regions:
        publisher:
          reliability: best_effort
          durability: transient_local
          history: keep_last
          depth: 20
      /robot/left/image_rect:
        subscription_main:
          reliability: reliable
/other:
  ros__parameters:
    qos_overrides: {/robot/regions: {publisher: {depth: 3}}}
";

    #[test]
    fn what_is_named_is_replaced_and_the_rest_stays() {
        let all = overrides(FILE).unwrap();
        let regions = all.apply("/robot/regions", Role::Publisher, &qos::output());
        assert_eq!(regions.reliability(), Some(Reliability::BestEffort));
        assert_eq!(regions.durability(), Some(Durability::TransientLocal));
        assert_eq!(regions.history(), Some(History::KeepLast { depth: 20 }));
        let image = all.apply("/robot/left/image_rect", Role::Subscription, &qos::sensor_data());
        assert!(image.is_reliable() && image.is_volatile());
        assert_eq!(image.history(), qos::sensor_data().history());
        let untouched = all.apply("/robot/regions", Role::Subscription, &qos::output());
        assert_eq!(untouched, qos::output());
        assert_eq!(all.topics().filter(|t| *t == "/robot/regions").count(), 4);
    }

    #[test]
    fn what_means_nothing_is_refused_with_what_is_allowed() {
        for (text, part) in [
            ("qos_overrides./a.publisher.reliability: 3", "reliable or best_effort"),
            ("qos_overrides./a.publisher.depth: 0", "1 to 1000"),
            ("qos_overrides./a.publisher.history: keep_all", "keep_last is wanted"),
            ("qos_overrides./a.publisher.deadline: 3", "no policy 'deadline'"),
            ("qos_overrides./a.writer.depth: 3", "neither publisher nor subscription"),
            ("qos_overrides.a.publisher.depth: 3", "'a' is relative"),
            ("qos_overrides.depth: 3", "is wanted"),
        ] {
            let error = overrides(text).unwrap_err().to_string();
            assert!(error.contains(part) && error.contains("a.yaml: qos_overrides."), "{error}");
        }
    }
}
