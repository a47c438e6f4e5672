//! RIHS01: the hash of a type (REP 2016).
//!
//! The SHA-256 of a JSON text that describes the type and all types in it, by
//! name; comments, constants and default values do not count.

use std::collections::BTreeMap;
use std::fmt::Write;

use sha2::{Digest, Sha256};

use super::parse::{Count, Field, Member};

// Numbers of type_description_interfaces/msg/FieldType.
const NESTED: u32 = 1;
const BOUNDED_STRING: u32 = 21;
const ARRAY: u32 = 48;
const BOUNDED_SEQUENCE: u32 = 96;
const SEQUENCE: u32 = 144;

/// The hash of `type_name`; `None` when a text is missing or cannot be read.
pub fn rihs01(type_name: &str) -> Option<String> {
    let mut types = BTreeMap::new();
    collect(type_name, &mut types)?;
    let own = types.remove(type_name)?;
    let others: Vec<_> =
        types.iter().map(|(name, fields)| described(name, fields)).collect::<Option<_>>()?;
    let json = format!(
        r#"{{"type_description": {}, "referenced_type_descriptions": [{}]}}"#,
        described(type_name, &own)?,
        others.join(", ")
    );
    let mut out = String::from("RIHS01_");
    for byte in Sha256::digest(json.as_bytes()) {
        // Writing into a String cannot fail.
        let _ = write!(out, "{byte:02x}");
    }
    Some(out)
}

/// The fields of `type_name` and of all types in it.
fn collect(type_name: &str, types: &mut BTreeMap<String, Vec<Field>>) -> Option<()> {
    if types.contains_key(type_name) {
        return Some(());
    }
    let fields = super::fields(type_name)?;
    types.insert(type_name.to_owned(), fields.clone());
    for field in fields {
        if let Member::Nested(nested) = &field.member {
            collect(nested, types)?;
        }
    }
    Some(())
}

/// The JSON of one type. Names are identifiers, so nothing needs escaping.
fn described(type_name: &str, fields: &[Field]) -> Option<String> {
    let fields: Vec<_> = fields.iter().map(described_field).collect::<Option<_>>()?;
    Some(format!(r#"{{"type_name": "{type_name}", "fields": [{}]}}"#, fields.join(", ")))
}

fn described_field(field: &Field) -> Option<String> {
    let (element, string_capacity, nested) = match &field.member {
        Member::Plain(name) => (plain_type_id(name)?, 0, ""),
        Member::BoundedString(bound) => (BOUNDED_STRING, *bound, ""),
        Member::Nested(name) => (NESTED, 0, name.as_str()),
    };
    let (offset, capacity) = match field.count {
        Count::One => (0, 0),
        Count::Exactly(n) => (ARRAY, n),
        Count::AtMost(n) => (BOUNDED_SEQUENCE, n),
        Count::Any => (SEQUENCE, 0),
    };
    Some(format!(
        r#"{{"name": "{}", "type": {{"type_id": {}, "capacity": {capacity}, "string_capacity": {string_capacity}, "nested_type_name": "{nested}"}}}}"#,
        field.name,
        element + offset,
    ))
}

fn plain_type_id(name: &str) -> Option<u32> {
    Some(match name {
        "int8" => 2,
        // `char` of a .msg text is an unsigned byte.
        "uint8" | "char" => 3,
        "int16" => 4,
        "uint16" => 5,
        "int32" => 6,
        "uint32" => 7,
        "int64" => 8,
        "uint64" => 9,
        "float32" => 10,
        "float64" => 11,
        "bool" => 15,
        "byte" => 16,
        "string" => 17,
        "wstring" => 18,
        _ => return None,
    })
}
