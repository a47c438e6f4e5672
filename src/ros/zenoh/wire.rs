//! What travels beside each payload: a number, a time and who sent it.

use std::time::{SystemTime, UNIX_EPOCH};

use ros2_client::{Gid, MessageInfo, ROSTime, RmwRequestId};

/// Number (8 bytes), time (8), length of the identity (1), identity (16).
const LEN: usize = 33;

/// The attachment of a message, a request or a response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Attachment {
    /// Counts what one endpoint has sent, from 1 on.
    pub sequence: i64,
    /// Nanoseconds since 1970.
    pub time_ns: i64,
    /// Identity of the sender.
    pub gid: [u8; 16],
}

impl Attachment {
    /// An attachment of this moment.
    pub fn now(sequence: i64, gid: [u8; 16]) -> Self {
        let time_ns = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .ok()
            .and_then(|since| i64::try_from(since.as_nanos()).ok())
            .unwrap_or_default();
        Self { sequence, time_ns, gid }
    }

    pub fn to_bytes(self) -> [u8; LEN] {
        let mut bytes = [0; LEN];
        bytes[..8].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.time_ns.to_le_bytes());
        bytes[16] = 16;
        bytes[17..].copy_from_slice(&self.gid);
        bytes
    }

    /// `None` when these bytes are no attachment.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (sequence, rest) = bytes.split_first_chunk()?;
        let (time_ns, rest) = rest.split_first_chunk()?;
        let (&[16], rest) = rest.split_first_chunk()? else { return None };
        Some(Self {
            sequence: i64::from_le_bytes(*sequence),
            time_ns: i64::from_le_bytes(*time_ns),
            gid: rest.try_into().ok()?,
        })
    }

    /// The request that it belongs to.
    pub fn request_id(self) -> RmwRequestId {
        RmwRequestId { writer_gid: Gid::from(self.gid), sequence_number: self.sequence }
    }

    /// The same for whoever takes the message.
    pub fn info(self) -> MessageInfo {
        let time = ROSTime::from_nanos(self.time_ns);
        MessageInfo::new(None, Some(time), self.sequence, Gid::from(self.gid), None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_attachment_has_the_form_of_the_rmw() {
        let attachment = Attachment { sequence: 7, time_ns: 0x0102, gid: [0xab; 16] };
        let bytes = attachment.to_bytes();
        assert_eq!(bytes[..17], [7, 0, 0, 0, 0, 0, 0, 0, 2, 1, 0, 0, 0, 0, 0, 0, 16]);
        assert_eq!(bytes[17..], [0xab; 16]);
        assert_eq!(Attachment::from_bytes(&bytes), Some(attachment));
        for bad in [&bytes[..32], &[], &[0; LEN]] {
            assert_eq!(Attachment::from_bytes(bad), None);
        }
    }
}
