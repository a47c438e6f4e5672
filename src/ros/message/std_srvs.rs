//! The service without arguments.

#![allow(missing_docs, reason = "the .srv texts document the fields")]

use serde::{Deserialize, Serialize};

/// The request of `Trigger`. IDL knows no empty structure, so one byte of no
/// meaning travels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerRequest {
    pub structure_needs_at_least_one_member: u8,
}

/// What came of it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerResponse {
    pub success: bool,
    pub message: String,
}

message! {
    TriggerRequest = "std_srvs/srv/Trigger_Request",
    TriggerResponse = "std_srvs/srv/Trigger_Response",
}
