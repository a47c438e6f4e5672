//! YAML as a tree that keeps the order of the file, because in parameter files
//! a later entry wins over an earlier one.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::Value;

/// One node of a YAML document.
#[derive(Clone, Debug, PartialEq)]
pub enum Yaml {
    /// Null, boolean, number or text.
    Scalar(Value),
    /// A list.
    Sequence(Vec<Yaml>),
    /// A mapping in the order of the file.
    Map(Vec<(String, Yaml)>),
}

impl Yaml {
    /// The tree of one document.
    ///
    /// # Errors
    /// The parser's message, with line and column.
    pub fn parse(text: &str) -> Result<Self, String> {
        serde_saphyr::from_str(text).map_err(|error| error.to_string())
    }
}

impl<'de> Deserialize<'de> for Yaml {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Tree)
    }
}

struct Tree;

impl<'de> Visitor<'de> for Tree {
    type Value = Yaml;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a YAML value")
    }

    fn visit_unit<E: Error>(self) -> Result<Yaml, E> {
        Ok(Yaml::Scalar(Value::Null))
    }

    fn visit_none<E: Error>(self) -> Result<Yaml, E> {
        Ok(Yaml::Scalar(Value::Null))
    }

    fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<Yaml, D::Error> {
        deserializer.deserialize_any(Self)
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Yaml, E> {
        Ok(Yaml::Scalar(Value::Bool(value)))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Yaml, E> {
        Ok(Yaml::Scalar(value.into()))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Yaml, E> {
        Ok(Yaml::Scalar(value.into()))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Yaml, E> {
        // JSON has no form for infinities and NaN; as text they meet the type
        // check of their parameter, which names them.
        Ok(Yaml::Scalar(match serde_json::Number::from_f64(value) {
            Some(number) => Value::Number(number),
            None => Value::String(value.to_string()),
        }))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Yaml, E> {
        Ok(Yaml::Scalar(value.into()))
    }

    fn visit_string<E: Error>(self, value: String) -> Result<Yaml, E> {
        Ok(Yaml::Scalar(value.into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Yaml, A::Error> {
        let mut sequence = Vec::new();
        while let Some(item) = items.next_element()? {
            sequence.push(item);
        }
        Ok(Yaml::Sequence(sequence))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Yaml, A::Error> {
        let mut map = Vec::new();
        while let Some(entry) = entries.next_entry()? {
            map.push(entry);
        }
        Ok(Yaml::Map(map))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn scalar(text: &str) -> Value {
        match Yaml::parse(text).unwrap() {
            Yaml::Scalar(value) => value,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn scalars_have_the_types_that_ros_gives_them() {
        assert_eq!(scalar("7"), json!(7));
        assert_eq!(scalar("-7"), json!(-7));
        assert_eq!(scalar("7.0"), json!(7.0));
        assert_eq!(scalar("1e-3"), json!(1e-3));
        assert_eq!(scalar("true"), json!(true));
        assert_eq!(scalar("two_topics"), json!("two_topics"));
        assert_eq!(scalar("'7'"), json!("7"));
        assert_eq!(scalar("32FC1"), json!("32FC1"));
        assert_eq!(scalar("none"), json!("none"));
    }

    #[test]
    fn the_order_of_the_file_is_kept_and_a_repeated_key_refused() {
        let Yaml::Map(entries) = Yaml::parse("z: 1\na: 2\n/**: 3\n").unwrap() else { panic!() };
        let keys: Vec<_> = entries.iter().map(|(key, _)| key.as_str()).collect();
        assert_eq!(keys, ["z", "a", "/**"]);
        assert!(Yaml::parse("a: 1\na: 2\n").is_err());
    }
}
