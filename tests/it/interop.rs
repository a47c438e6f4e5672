//! The node and peers of other makes, the metrics and referees. They need packages that cargo does not
//! bring, so they run only when asked for:
//!
//! ```text
//! pip install -r tests/interop/requirements.txt
//! SALIENT_STEREO_INTEROP=1 cargo test --test it interop::
//! ```
//!
//! `SALIENT_STEREO_PYTHON` names another interpreter than `python3`.

mod referee;

use std::path::{Path, PathBuf};
use std::process::Command;

use salient_stereo::config::Config;
use salient_stereo::ros::NODE_NAME;
use salient_stereo::ros::environment::Environment;
use salient_stereo::ros::names::Names;
use salient_stereo::ros::runtime::{NodeOptions, NodeRuntime};
use serde_json::json;

/// A script of `tests/interop`; `None` unless such tests were asked for.
fn script(name: &str) -> Option<PathBuf> {
    if std::env::var_os("SALIENT_STEREO_INTEROP").is_none() {
        println!("skipped: set SALIENT_STEREO_INTEROP=1 to test with {name}");
        return None;
    }
    Some(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop").join(name))
}

fn python() -> Command {
    Command::new(std::env::var_os("SALIENT_STEREO_PYTHON").unwrap_or_else(|| "python3".into()))
}

#[test]
fn a_cyclone_peer_gets_one_region_array_per_pair() {
    let Some(script) = script("cyclone_stereo.py") else { return };
    for (test, reliability) in [(4, "reliable"), (4, "best_effort")] {
        let domain = 1 + (std::process::id() % 12) as u16 * 8 + test;
        let names = Names::new("/robot", NODE_NAME, &[]).unwrap();
        let config = Config::default().with("saliency.mode", &json!("paper")).unwrap();
        let mut runtime =
            NodeRuntime::start(NodeOptions::new(config, names, Environment::localhost(domain)))
                .unwrap();
        // Small and slow: this is about the wire, not about load.
        let output = python()
            .arg(&script)
            .args(["--domain", &domain.to_string(), "--namespace", "/robot"])
            .args(["--pairs", "20", "--rate", "2", "--width", "320", "--height", "120"])
            .args(["--reliability", reliability])
            .output()
            .unwrap_or_else(|e| panic!("{}: {e}", python().get_program().display()));
        println!("{}", String::from_utf8_lossy(&output.stdout));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(runtime.status().totals().paired, 20);
        assert!(runtime.stop());
    }
}
