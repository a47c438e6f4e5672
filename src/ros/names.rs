//! ROS 2 names: what a node calls a topic or service, and what the graph calls
//! it after expansion and remapping.

use thiserror::Error;

/// A name that the graph does not allow.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("'{name}' is no valid {what}: {reason}")]
pub struct NameError {
    /// The name as given.
    pub name: String,
    /// `topic or service name`, `node name` or `namespace`.
    pub what: &'static str,
    /// What is wrong with it.
    pub reason: &'static str,
}

/// One rule of `-r`, in the order of the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remap {
    /// Base name of the only node it is for; all nodes without.
    pub node: Option<String>,
    /// Which names it is for.
    pub kind: RemapKind,
    /// The name to be replaced, as given; empty for node and namespace.
    pub from: String,
    /// The name that replaces it, as given.
    pub to: String,
}

/// What a remap rule replaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RemapKind {
    /// `__ns`
    Namespace,
    /// `__node`
    Node,
    /// A topic or a service.
    Any,
    /// `rostopic://`
    Topic,
    /// `rosservice://`
    Service,
}

/// The names of one node: its own and those of its topics and services.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Names {
    namespace: String,
    node: String,
    rules: Vec<Remap>,
}

impl Names {
    /// The names of the node `node` in `namespace` under `rules`.
    ///
    /// For each of node name, namespace, topic and service the first matching
    /// rule wins and is applied once, as in rcl.
    ///
    /// # Errors
    /// When a rule, the node name or the namespace breaks the naming rules.
    pub fn new(namespace: &str, node: &str, rules: &[Remap]) -> Result<Self, NameError> {
        let for_node = |rule: &&Remap| rule.node.as_deref().is_none_or(|name| name == node);
        let first = |kind| rules.iter().filter(for_node).find(|rule| rule.kind == kind);

        let namespace = first(RemapKind::Namespace).map_or(namespace, |rule| &rule.to);
        let namespace =
            if namespace.starts_with('/') { namespace.to_owned() } else { format!("/{namespace}") };
        if namespace != "/" {
            check_full_name(&namespace, "namespace")?;
        }
        let name = first(RemapKind::Node).map_or(node, |rule| &rule.to);
        if let Some(reason) = token_fault(name) {
            return Err(NameError { name: name.to_owned(), what: "node name", reason });
        }
        let mut names = Self { namespace, node: name.to_owned(), rules: Vec::new() };
        for rule in rules.iter().filter(|rule| {
            !matches!(rule.kind, RemapKind::Namespace | RemapKind::Node)
                && rule.node.as_deref().is_none_or(|node| node == names.node)
        }) {
            names.expand(&rule.from)?;
            names.expand(&rule.to)?;
            names.rules.push(rule.clone());
        }
        Ok(names)
    }

    /// `/` or `/a/b`.
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// The node's name without its namespace.
    pub fn node(&self) -> &str {
        &self.node
    }

    /// `/namespace/node`.
    pub fn full_name(&self) -> String {
        join(&self.namespace, &self.node)
    }

    /// The logger's name as rclpy and rclcpp write it: `namespace.node`.
    pub fn logger(&self) -> String {
        self.full_name()[1..].replace('/', ".")
    }

    /// The full name of a topic after expansion and remapping.
    ///
    /// # Errors
    /// When the name breaks the naming rules.
    pub fn topic(&self, name: &str) -> Result<String, NameError> {
        self.resolve(name, RemapKind::Topic)
    }

    /// The full name of a service after expansion and remapping.
    ///
    /// # Errors
    /// When the name breaks the naming rules.
    pub fn service(&self, name: &str) -> Result<String, NameError> {
        self.resolve(name, RemapKind::Service)
    }

    /// The full name of `<topic>/compressed`, `<topic>/compressedDepth` and the
    /// like: the image topic is remapped first, as `image_transport` does, then
    /// its compressed form.
    ///
    /// # Errors
    /// When the name breaks the naming rules.
    pub fn transport_topic(&self, image_topic: &str, transport: &str) -> Result<String, NameError> {
        self.topic(&format!("{}/{transport}", self.topic(image_topic)?))
    }

    fn resolve(&self, name: &str, kind: RemapKind) -> Result<String, NameError> {
        let full = self.expand(name)?;
        for rule in self.rules.iter().filter(|r| r.kind == kind || r.kind == RemapKind::Any) {
            if self.expand(&rule.from)? == full {
                return self.expand(&rule.to);
            }
        }
        Ok(full)
    }

    /// `~`, `{node}`, `{ns}` and relative names made absolute.
    fn expand(&self, name: &str) -> Result<String, NameError> {
        let fault =
            |reason| NameError { name: name.to_owned(), what: "topic or service name", reason };
        let substituted = name
            .replace("{node}", &self.node)
            .replace("{namespace}", &self.namespace)
            .replace("{ns}", &self.namespace);
        let full = match substituted.strip_prefix('~') {
            Some("") => self.full_name(),
            Some(rest) if rest.starts_with('/') => format!("{}{rest}", self.full_name()),
            Some(_) => return Err(fault("'~' must be followed by '/'")),
            None if substituted.starts_with('/') => substituted,
            None => join(&self.namespace, &substituted),
        };
        // `{ns}` of the root namespace leaves `//` behind.
        let full = if name.contains('{') { full.replace("//", "/") } else { full };
        check_full_name(&full, "topic or service name").map_err(|e| fault(e.reason))?;
        Ok(full)
    }
}

fn join(namespace: &str, name: &str) -> String {
    if namespace == "/" { format!("/{name}") } else { format!("{namespace}/{name}") }
}

fn check_full_name(name: &str, what: &'static str) -> Result<(), NameError> {
    let reason = if name.len() > 245 {
        Some("it is longer than 245 characters")
    } else {
        name.get(1..).unwrap_or_default().split('/').find_map(token_fault)
    };
    reason.map_or(Ok(()), |reason| Err(NameError { name: name.to_owned(), what, reason }))
}

fn token_fault(token: &str) -> Option<&'static str> {
    if token.is_empty() {
        Some("a part of it is empty")
    } else if token.starts_with(|c: char| c.is_ascii_digit()) {
        Some("a part of it starts with a digit")
    } else if token.contains('*') {
        Some("wildcards are not supported")
    } else if !token.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
        Some("only letters, digits, '_' and '/' are allowed")
    } else if token.contains("__") {
        Some("'__' is reserved")
    } else {
        None
    }
}

/// True when the node pattern of a parameter file (`/**`, `/*`, `/ns/node`,
/// `node`) is for the node with this full name.
pub fn node_matches(pattern: &str, full_name: &str) -> bool {
    fn tokens<'a>(pattern: &[&'a str], name: &[&'a str]) -> bool {
        match pattern.split_first() {
            None => name.is_empty(),
            Some((&"**", rest)) => (0..=name.len()).any(|skip| tokens(rest, &name[skip..])),
            Some((&first, rest)) => name.split_first().is_some_and(|(&token, tail)| {
                (first == "*" || first == token) && tokens(rest, tail)
            }),
        }
    }
    let pattern: Vec<&str> = pattern.trim_start_matches('/').split('/').collect();
    let name: Vec<&str> = full_name.trim_start_matches('/').split('/').collect();
    // More than a few `**` are no pattern that anyone writes, and matching them
    // would take exponential time.
    pattern.iter().filter(|token| **token == "**").count() <= 4 && tokens(&pattern, &name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rule(kind: RemapKind, from: &str, to: &str) -> Remap {
        Remap { node: None, kind, from: from.into(), to: to.into() }
    }

    #[test]
    fn relative_private_and_absolute_names_expand() {
        let names = Names::new("/stereo", "salient", &[]).unwrap();
        assert_eq!(names.topic("left/image_rect").unwrap(), "/stereo/left/image_rect");
        assert_eq!(names.topic("/diagnostics").unwrap(), "/diagnostics");
        assert_eq!(names.service("~/reset").unwrap(), "/stereo/salient/reset");
        assert_eq!(names.topic("{node}/x").unwrap(), "/stereo/salient/x");
        assert_eq!(names.logger(), "stereo.salient");
        let root = Names::new("/", "salient", &[]).unwrap();
        assert_eq!(root.topic("regions").unwrap(), "/regions");
        assert_eq!(root.topic("{ns}/regions").unwrap(), "/regions");
        assert_eq!(root.full_name(), "/salient");
    }

    #[test]
    fn the_first_matching_rule_wins_and_is_applied_once() {
        let names = Names::new(
            "/",
            "n",
            &[
                rule(RemapKind::Any, "a", "b"),
                rule(RemapKind::Any, "a", "c"),
                rule(RemapKind::Any, "b", "d"),
                rule(RemapKind::Service, "s", "t"),
            ],
        )
        .unwrap();
        assert_eq!(names.topic("a").unwrap(), "/b");
        assert_eq!(names.topic("b").unwrap(), "/d");
        assert_eq!(names.topic("s").unwrap(), "/s");
        assert_eq!(names.service("s").unwrap(), "/t");
    }

    #[test]
    fn the_first_namespace_and_the_first_node_name_win() {
        let names = Names::new(
            "/",
            "n",
            &[
                rule(RemapKind::Namespace, "", "/one"),
                rule(RemapKind::Namespace, "", "/two"),
                rule(RemapKind::Node, "", "m"),
                Remap { node: Some("other".into()), ..rule(RemapKind::Any, "a", "b") },
                Remap { node: Some("m".into()), ..rule(RemapKind::Any, "a", "/c") },
            ],
        )
        .unwrap();
        assert_eq!(names.full_name(), "/one/m");
        assert_eq!(names.topic("a").unwrap(), "/c");
    }

    #[test]
    fn an_image_topic_is_remapped_before_its_compressed_form() {
        let names =
            Names::new("/", "n", &[rule(RemapKind::Any, "left/image_rect", "/cam/l")]).unwrap();
        assert_eq!(
            names.transport_topic("left/image_rect", "compressed").unwrap(),
            "/cam/l/compressed"
        );
    }

    #[test]
    fn bad_names_are_refused_with_the_reason() {
        for (from, to) in [("a b", "c"), ("a", "1c"), ("a", "b//c"), ("a", "~b"), ("a", "b__c")] {
            let error = Names::new("/", "n", &[rule(RemapKind::Any, from, to)]).unwrap_err();
            assert!(error.to_string().contains("no valid topic"), "{error}");
        }
        assert!(Names::new("/a/", "n", &[]).is_err());
        assert!(Names::new("/", "n/m", &[]).is_err());
    }

    #[test]
    fn node_patterns_match_like_those_of_rcl() {
        for pattern in ["/**", "/ns/node", "ns/node", "/*/node", "/ns/*", "/**/node"] {
            assert!(node_matches(pattern, "/ns/node"), "{pattern}");
        }
        for pattern in ["/*", "/node", "/ns/other", "/ns/node/x", ""] {
            assert!(!node_matches(pattern, "/ns/node"), "{pattern}");
        }
        assert!(node_matches("*", "/node") && node_matches("**", "/node"));
    }
}
