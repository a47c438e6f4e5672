//! CDR, the byte form in which messages travel (OMG XCDR version 1, plain).
//!
//! Four bytes of encapsulation header come first: `00 01` little endian or
//! `00 00` big endian, then two option bytes that carry nothing here. Numbers
//! are aligned to their size, counted from the end of the header.
//!
//! The `cdr-encoding` crate does the rest. It checks each length on the wire
//! against what is left before it copies strings and bytes, and lets other
//! sequences grow element by element, so a few bytes cannot ask for gigabytes.

use byteorder::{BigEndian, LittleEndian};
use thiserror::Error;

use crate::ros::message::Message;

const LITTLE_ENDIAN: [u8; 2] = [0, 1];
const BIG_ENDIAN: [u8; 2] = [0, 0];
const HEADER_LEN: usize = 4;

/// Some writers fill the payload up to a multiple of four.
const MAX_PADDING: usize = 3;

/// Bytes that are not the message they should be.
#[derive(Debug, Error)]
pub enum CdrError {
    /// Not even a header.
    #[error("{type_name}: {len} bytes, but the CDR header alone has 4")]
    NoHeader {
        /// What was to be decoded.
        type_name: &'static str,
        /// Length of the payload.
        len: usize,
    },
    /// A representation that we do not read.
    #[error(
        "{type_name}: CDR header {first:02x} {second:02x} is not plain CDR (00 00 big endian, 00 01 little endian)"
    )]
    Representation {
        /// What was to be decoded.
        type_name: &'static str,
        /// First byte of the header.
        first: u8,
        /// Second byte of the header.
        second: u8,
    },
    /// The payload ends early or holds values that the type does not have.
    #[error("{type_name}: {len} bytes of CDR do not hold this message: {source}")]
    Content {
        /// What was to be decoded.
        type_name: &'static str,
        /// Length of the payload.
        len: usize,
        /// What was met.
        source: cdr_encoding::Error,
    },
    /// More bytes than the message has: most likely another version of the type.
    #[error(
        "{type_name}: the message ends after {used} of {len} bytes: the sender's definition of the type differs"
    )]
    Leftover {
        /// What was to be decoded.
        type_name: &'static str,
        /// Bytes that the message took, header included.
        used: usize,
        /// Length of the payload.
        len: usize,
    },
}

/// The message as little-endian CDR with its header.
pub fn encode<T: Message>(message: &T) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode_into(message, &mut bytes);
    bytes
}

/// Replaces the content of `bytes` by the message as little-endian CDR with
/// its header; the capacity is kept.
pub fn encode_into<T: Message>(message: &T, bytes: &mut Vec<u8>) {
    bytes.clear();
    bytes.extend_from_slice(&[LITTLE_ENDIAN[0], LITTLE_ENDIAN[1], 0, 0]);
    cdr_encoding::to_writer::<_, LittleEndian, _>(&mut *bytes, message)
        // A Vec takes any bytes, and the messages are structures of numbers,
        // strings and sequences of known length: nothing is left to fail.
        .expect("every message has a CDR form");
}

/// The message that `bytes` (header included) hold, in either byte order.
///
/// What stands in padding is ignored; up to three bytes may follow the message.
///
/// # Errors
/// When the header is missing or of another representation, when the bytes end
/// early or hold values that the type does not have, or when more follows.
pub fn decode<T: Message>(bytes: &[u8]) -> Result<T, CdrError> {
    let type_name = T::TYPE_NAME;
    let len = bytes.len();
    let Some((&[first, second, _, _], body)) = bytes.split_first_chunk::<HEADER_LEN>() else {
        return Err(CdrError::NoHeader { type_name, len });
    };
    let (message, used) = match [first, second] {
        LITTLE_ENDIAN => cdr_encoding::from_bytes::<T, LittleEndian>(body),
        BIG_ENDIAN => cdr_encoding::from_bytes::<T, BigEndian>(body),
        _ => return Err(CdrError::Representation { type_name, first, second }),
    }
    .map_err(|source| CdrError::Content { type_name, len, source })?;
    if body.len() - used > MAX_PADDING {
        return Err(CdrError::Leftover { type_name, used: used + HEADER_LEN, len });
    }
    Ok(message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::message::builtin_interfaces::Time;
    use crate::ros::message::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
    use crate::ros::message::geometry_msgs::Polygon;
    use crate::ros::message::rcl_interfaces::{GetParameterTypesResponse, GetParametersRequest};
    use crate::ros::message::std_msgs::Header;

    fn header() -> Header {
        Header { stamp: Time { sec: 1, nanosec: 2 }, frame_id: "left".into() }
    }

    #[test]
    fn both_byte_orders_are_read() {
        let little = encode(&header());
        assert_eq!(little, b"\0\x01\0\0\x01\0\0\0\x02\0\0\0\x05\0\0\0left\0");
        assert_eq!(decode::<Header>(&little).unwrap(), header());
        let big = b"\0\0\0\0\0\0\0\x01\0\0\0\x02\0\0\0\x05left\0";
        assert_eq!(decode::<Header>(big).unwrap(), header());
    }

    #[test]
    fn encode_into_keeps_the_capacity() {
        let mut bytes = Vec::with_capacity(1000);
        encode_into(&header(), &mut bytes);
        assert_eq!(bytes, encode(&header()));
        assert_eq!(bytes.capacity(), 1000);
    }

    #[test]
    fn other_representations_are_refused_by_name() {
        let mut bytes = encode(&header());
        bytes[1] = 3;
        let text = decode::<Header>(&bytes).unwrap_err().to_string();
        assert!(text.contains("std_msgs/msg/Header") && text.contains("00 03"), "{text}");
        let text = decode::<Header>(&[0, 1]).unwrap_err().to_string();
        assert!(text.contains("2 bytes"), "{text}");
    }

    #[test]
    fn every_cut_is_an_error() {
        let status = DiagnosticStatus { name: "n".into(), ..Default::default() };
        let bytes = encode(&DiagnosticArray { header: header(), status: vec![status; 2] });
        for len in 0..bytes.len() {
            assert!(decode::<DiagnosticArray>(&bytes[..len]).is_err(), "cut at {len}");
        }
    }

    #[test]
    fn padding_may_follow_but_no_more() {
        let mut bytes = encode(&header());
        bytes.extend([7; 3]);
        assert_eq!(decode::<Header>(&bytes).unwrap(), header());
        bytes.push(7);
        let text = decode::<Header>(&bytes).unwrap_err().to_string();
        assert!(text.contains("ends after 21 of 25 bytes"), "{text}");
    }

    #[test]
    fn bytes_in_the_padding_are_ignored() {
        let mut bytes = encode(&DiagnosticArray {
            header: header(),
            status: vec![DiagnosticStatus { level: 2, ..Default::default() }],
        });
        // The frame's name ends at 21, the count stands at 24, the level at 28.
        assert_eq!((bytes[24], bytes[28]), (1, 2));
        bytes[21..24].fill(0xaa);
        bytes[29..32].fill(0xaa);
        assert_eq!(decode::<DiagnosticArray>(&bytes).unwrap().status[0].level, 2);
    }

    #[test]
    fn a_length_beyond_the_payload_is_an_error() {
        // 12 bytes that claim 4 GiB; tests/memory.rs measures that none is taken.
        let bytes = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0];
        assert!(decode::<GetParameterTypesResponse>(&bytes).is_err());
        assert!(decode::<Polygon>(&bytes).is_err());
        assert!(decode::<GetParametersRequest>(&bytes).is_err());
        let string = [0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff];
        assert!(decode::<Header>(&string).is_err());
    }

    #[test]
    fn text_that_is_not_utf8_is_an_error() {
        let mut bytes = encode(&header());
        bytes[16] = 0xff;
        assert!(decode::<Header>(&bytes).is_err());
    }
}
