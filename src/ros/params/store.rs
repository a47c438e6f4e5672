//! The parameters in force: set by services, read at frame boundaries.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde_json::Value;

use super::value::{from_ros, to_ros};
use crate::config::{Config, field};
use crate::ros::message::rcl_interfaces::{Parameter, ParameterValue};

/// The parameters in force, shared between threads.
#[derive(Debug)]
pub struct ParameterStore {
    config: Mutex<Arc<Config>>,
    generation: AtomicU64,
}

impl ParameterStore {
    /// A store with these values.
    pub fn new(config: Config) -> Self {
        Self { config: Mutex::new(Arc::new(config)), generation: AtomicU64::new(0) }
    }

    /// The values in force.
    pub fn config(&self) -> Arc<Config> {
        Arc::clone(&self.lock())
    }

    /// Counts the changes, so that a reader can see cheaply whether there was one.
    pub fn generation(&self) -> u64 {
        self.generation.load(Ordering::Acquire)
    }

    /// The value of one parameter; not set when there is none of this name.
    pub fn get(&self, name: &str) -> ParameterValue {
        self.lock().value(name).map(|value| to_ros(&value)).unwrap_or_default()
    }

    /// Sets all parameters or none. The frame that is being processed is not
    /// affected, the next one is.
    ///
    /// # Errors
    /// Why they were refused, in words for the one who asked.
    pub fn set(&self, parameters: &[Parameter]) -> Result<(), String> {
        let mut values: Vec<(&str, Value)> = Vec::with_capacity(parameters.len());
        for Parameter { name, value } in parameters {
            let field = field(name).map_err(|e| e.to_string())?;
            if field.start_only {
                // A dump that is loaded names these too, with the values they have.
                if self.get(name) == *value {
                    continue;
                }
                return Err(format!(
                    "parameter '{name}' is read at start: restart the node with -p {name}:=…"
                ));
            }
            let value = from_ros(value).map_err(|e| format!("parameter '{name}': {e}"))?;
            values.push((field.name, value));
        }
        let mut current = self.lock();
        let next = current.with_all(values).map_err(|e| e.to_string())?;
        if next != **current {
            *current = Arc::new(next);
            self.generation.fetch_add(1, Ordering::Release);
        }
        Ok(())
    }

    fn lock(&self) -> MutexGuard<'_, Arc<Config>> {
        // The value is replaced as a whole: a panic elsewhere leaves it valid.
        self.config.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn parameter(name: &str, value: &Value) -> Parameter {
        Parameter { name: name.into(), value: to_ros(value) }
    }

    #[test]
    fn a_change_is_taken_whole_and_counted() {
        let store = ParameterStore::new(Config::default());
        store
            .set(&[parameter("depth.min", &json!(100.0)), parameter("depth.max", &json!(200.0))])
            .unwrap();
        assert_eq!((store.generation(), store.config().depth.max), (1, 200.0));
        store.set(&[parameter("depth.max", &json!(200.0))]).unwrap();
        assert_eq!(store.generation(), 1);
    }

    #[test]
    fn everything_that_is_in_force_can_be_set_again() {
        let store = ParameterStore::new(Config::default());
        for (name, value) in Config::default().flatten() {
            store.set(&[parameter(name, &value)]).unwrap();
        }
        assert_eq!((store.generation(), &*store.config()), (0, &Config::default()));
    }

    #[test]
    fn a_refusal_says_why_and_changes_nothing() {
        let store = ParameterStore::new(Config::default());
        for (name, value, reason) in [
            ("saliency.threshold", json!(2.0), "[0, 1]"),
            ("saliency.treshold", json!(0.5), "saliency.threshold"),
            ("threads", json!(3), "at start"),
            ("rectify", json!(true), "at start"),
            ("depth.min", json!(1000.0), "depth.max"),
            ("lazy", Value::Null, "deleted"),
        ] {
            let text = store
                .set(&[parameter("stereo.p1", &json!(1)), parameter(name, &value)])
                .unwrap_err();
            assert!(text.contains(reason), "{text}");
        }
        assert_eq!((store.generation(), &*store.config()), (0, &Config::default()));
        assert_eq!(store.get("nothing"), ParameterValue::default());
    }
}
