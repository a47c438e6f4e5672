//! The `.msg` grammar, as far as our own texts use it.

/// The type of one element of a field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Member {
    /// A number, truth value or string without bound, by its name in `.msg`.
    Plain(&'static str),
    /// A string of bounded length.
    BoundedString(u64),
    /// Another message, as `pkg/msg/Type`.
    Nested(String),
}

/// How many elements a field has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// One.
    One,
    /// `[N]`
    Exactly(u64),
    /// `[<=N]`
    AtMost(u64),
    /// `[]`
    Any,
}

/// One field. Default values are left out: they do not travel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    pub name: String,
    pub member: Member,
    pub count: Count,
}

impl Field {
    pub fn new(name: &str, member: Member) -> Self {
        Self { name: name.to_owned(), member, count: Count::One }
    }

    pub fn nested(name: &str, type_name: String) -> Self {
        Self::new(name, Member::Nested(type_name))
    }

    pub fn at_most_one(self) -> Self {
        Self { count: Count::AtMost(1), ..self }
    }
}

const PLAIN: [&str; 15] = [
    "bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32",
    "uint32", "int64", "uint64", "string", "wstring",
];

/// The fields of a message text of `package`, constants left out; `None` when
/// a line cannot be read.
pub fn fields(package: &str, text: &str) -> Option<Vec<Field>> {
    let mut fields = Vec::new();
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let (type_text, rest) = line.split_once(char::is_whitespace)?;
        let rest = rest.trim_start();
        let name_len =
            rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        let (name, value) = rest.split_at(name_len);
        if value.trim_start().starts_with('=') {
            continue;
        }
        let (element, count) = split_count(type_text)?;
        fields.push(Field { name: name.to_owned(), member: member(package, element)?, count });
    }
    Some(fields)
}

fn split_count(type_text: &str) -> Option<(&str, Count)> {
    let Some((element, brackets)) = type_text.split_once('[') else {
        return Some((type_text, Count::One));
    };
    let inside = brackets.strip_suffix(']')?;
    let count = if inside.is_empty() {
        Count::Any
    } else if let Some(bound) = inside.strip_prefix("<=") {
        Count::AtMost(bound.parse().ok()?)
    } else {
        Count::Exactly(inside.parse().ok()?)
    };
    Some((element, count))
}

fn member(package: &str, element: &str) -> Option<Member> {
    if let Some(plain) = PLAIN.iter().find(|name| **name == element) {
        return Some(Member::Plain(plain));
    }
    if let Some(bound) = element.strip_prefix("string<=") {
        return Some(Member::BoundedString(bound.parse().ok()?));
    }
    Some(Member::Nested(match element.split_once('/') {
        None => format!("{package}/msg/{element}"),
        Some((package, name)) => format!("{package}/msg/{name}"),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_forms_of_a_field_are_told_apart() {
        let text = "# nothing\n\
            uint8 LIMIT=3   # a constant\n\
            string<=16 NOTE = \"x\"\n\
            float64 w 1\n\
            string<=10[<=3] words\n\
            byte[] data # bytes\n\
            char[16] id\n\
            Point here\n\
            std_msgs/Header header\n";
        let expected = [
            ("w", Member::Plain("float64"), Count::One),
            ("words", Member::BoundedString(10), Count::AtMost(3)),
            ("data", Member::Plain("byte"), Count::Any),
            ("id", Member::Plain("char"), Count::Exactly(16)),
            ("here", Member::Nested("geometry_msgs/msg/Point".into()), Count::One),
            ("header", Member::Nested("std_msgs/msg/Header".into()), Count::One),
        ]
        .map(|(name, member, count)| Field { name: name.into(), member, count });
        assert_eq!(fields("geometry_msgs", text).unwrap(), expected);
    }

    #[test]
    fn a_line_that_is_no_field_is_refused() {
        for text in ["uint8", "uint8[ x", "uint8[<=a] x", "string<=a x"] {
            assert_eq!(fields("p", text), None, "{text}");
        }
    }
}
