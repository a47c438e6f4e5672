//! Parameters, their services, and the log.

#![allow(missing_docs, reason = "the .msg and .srv texts document the fields")]

use serde::{Deserialize, Serialize};

use super::builtin_interfaces::Time;

/// One line of the log.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Log {
    pub stamp: Time,
    pub level: u8,
    pub name: String,
    pub msg: String,
    pub file: String,
    pub function: String,
    pub line: u32,
}

impl Log {
    pub const DEBUG: u8 = 10;
    pub const INFO: u8 = 20;
    pub const WARN: u8 = 30;
    pub const ERROR: u8 = 40;
    pub const FATAL: u8 = 50;
}

/// Types of parameters, for [`ParameterValue`]'s and [`ParameterDescriptor`]'s `type`.
pub struct ParameterType;

impl ParameterType {
    pub const PARAMETER_NOT_SET: u8 = 0;
    pub const PARAMETER_BOOL: u8 = 1;
    pub const PARAMETER_INTEGER: u8 = 2;
    pub const PARAMETER_DOUBLE: u8 = 3;
    pub const PARAMETER_STRING: u8 = 4;
    pub const PARAMETER_BYTE_ARRAY: u8 = 5;
    pub const PARAMETER_BOOL_ARRAY: u8 = 6;
    pub const PARAMETER_INTEGER_ARRAY: u8 = 7;
    pub const PARAMETER_DOUBLE_ARRAY: u8 = 8;
    pub const PARAMETER_STRING_ARRAY: u8 = 9;
}

/// A parameter's value: the member that `type` names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterValue {
    pub r#type: u8,
    pub bool_value: bool,
    pub integer_value: i64,
    pub double_value: f64,
    pub string_value: String,
    #[serde(with = "serde_bytes")]
    pub byte_array_value: Vec<u8>,
    pub bool_array_value: Vec<bool>,
    pub integer_array_value: Vec<i64>,
    pub double_array_value: Vec<f64>,
    pub string_array_value: Vec<String>,
}

/// A parameter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    pub name: String,
    pub value: ParameterValue,
}

/// The range of a real parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FloatingPointRange {
    pub from_value: f64,
    pub to_value: f64,
    pub step: f64,
}

/// The range of a whole parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct IntegerRange {
    pub from_value: i64,
    pub to_value: i64,
    pub step: u64,
}

/// What a parameter means and takes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterDescriptor {
    pub name: String,
    pub r#type: u8,
    pub description: String,
    pub additional_constraints: String,
    pub read_only: bool,
    pub dynamic_typing: bool,
    /// One element at most.
    pub floating_point_range: Vec<FloatingPointRange>,
    /// One element at most.
    pub integer_range: Vec<IntegerRange>,
}

/// Whether a parameter was taken, and why not.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetParametersResult {
    pub successful: bool,
    pub reason: String,
}

/// Names of parameters and of their groups.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ListParametersResult {
    pub names: Vec<String>,
    pub prefixes: Vec<String>,
}

/// What changed among a node's parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterEvent {
    pub stamp: Time,
    pub node: String,
    pub new_parameters: Vec<Parameter>,
    pub changed_parameters: Vec<Parameter>,
    pub deleted_parameters: Vec<Parameter>,
}

/// Asks for descriptions.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DescribeParametersRequest {
    pub names: Vec<String>,
}

/// The descriptions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DescribeParametersResponse {
    pub descriptors: Vec<ParameterDescriptor>,
}

/// Asks for types.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetParameterTypesRequest {
    pub names: Vec<String>,
}

/// The types.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetParameterTypesResponse {
    #[serde(with = "serde_bytes")]
    pub types: Vec<u8>,
}

/// Asks for values.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetParametersRequest {
    pub names: Vec<String>,
}

/// The values.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GetParametersResponse {
    pub values: Vec<ParameterValue>,
}

/// Asks for names.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ListParametersRequest {
    pub prefixes: Vec<String>,
    pub depth: u64,
}

impl ListParametersRequest {
    /// `depth`: no limit.
    pub const DEPTH_RECURSIVE: u64 = 0;
}

/// The names.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ListParametersResponse {
    pub result: ListParametersResult,
}

/// Sets parameters one by one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SetParametersRequest {
    pub parameters: Vec<Parameter>,
}

/// What became of each.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetParametersResponse {
    pub results: Vec<SetParametersResult>,
}

/// Sets all parameters or none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SetParametersAtomicallyRequest {
    pub parameters: Vec<Parameter>,
}

/// What became of them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetParametersAtomicallyResponse {
    pub result: SetParametersResult,
}

message! {
    Log = "rcl_interfaces/msg/Log",
    ParameterValue = "rcl_interfaces/msg/ParameterValue",
    Parameter = "rcl_interfaces/msg/Parameter",
    FloatingPointRange = "rcl_interfaces/msg/FloatingPointRange",
    IntegerRange = "rcl_interfaces/msg/IntegerRange",
    ParameterDescriptor = "rcl_interfaces/msg/ParameterDescriptor",
    SetParametersResult = "rcl_interfaces/msg/SetParametersResult",
    ListParametersResult = "rcl_interfaces/msg/ListParametersResult",
    ParameterEvent = "rcl_interfaces/msg/ParameterEvent",
    DescribeParametersRequest = "rcl_interfaces/srv/DescribeParameters_Request",
    DescribeParametersResponse = "rcl_interfaces/srv/DescribeParameters_Response",
    GetParameterTypesRequest = "rcl_interfaces/srv/GetParameterTypes_Request",
    GetParameterTypesResponse = "rcl_interfaces/srv/GetParameterTypes_Response",
    GetParametersRequest = "rcl_interfaces/srv/GetParameters_Request",
    GetParametersResponse = "rcl_interfaces/srv/GetParameters_Response",
    ListParametersRequest = "rcl_interfaces/srv/ListParameters_Request",
    ListParametersResponse = "rcl_interfaces/srv/ListParameters_Response",
    SetParametersRequest = "rcl_interfaces/srv/SetParameters_Request",
    SetParametersResponse = "rcl_interfaces/srv/SetParameters_Response",
    SetParametersAtomicallyRequest = "rcl_interfaces/srv/SetParametersAtomically_Request",
    SetParametersAtomicallyResponse = "rcl_interfaces/srv/SetParametersAtomically_Response",
}
