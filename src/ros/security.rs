//! DDS security: which enclave of an SROS 2 keystore the node takes its
//! identity and its permissions from, chosen as rcl chooses it.
//!
//! | variable | meaning |
//! |---|---|
//! | `ROS_SECURITY_ENABLE` | `true` turns it on |
//! | `ROS_SECURITY_STRATEGY` | `Enforce`: secured or not at all; `Permissive`: unsecured where no enclave is found |
//! | `ROS_SECURITY_KEYSTORE` | the folder that `ros2 security create_keystore` made |
//! | `ROS_SECURITY_ENCLAVE_OVERRIDE` | the enclave, stronger than `--enclave` |
//!
//! The cryptography is `RustDDS`'s, in builds with the cargo feature `security`.

use std::path::{Component, Path, PathBuf};

use thiserror::Error;

/// What an enclave's folder holds.
const FILES: [&str; 6] = [
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
];

/// Certificates that the identity CA took back. `RustDDS` does not read it.
const REVOCATIONS: &str = "crl.pem";

/// The enclave of a process that names none.
const ROOT_ENCLAVE: &str = "/";

/// Why traffic cannot be secured.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SecurityError {
    /// The cargo feature is off.
    #[error(
        "DDS security is asked for (ROS_SECURITY_ENABLE=true), and this build has none: \
         build with `cargo build --release --features security`, or unset ROS_SECURITY_ENABLE"
    )]
    NotBuilt,
    /// The traffic is not DDS.
    #[error(
        "DDS security is asked for (ROS_SECURITY_ENABLE=true), and Zenoh traffic is not secured by it: \
         unset ROS_SECURITY_ENABLE, or choose a DDS with RMW_IMPLEMENTATION"
    )]
    Zenoh,
    /// No keystore is named.
    #[error(
        "DDS security is asked for (ROS_SECURITY_ENABLE=true), but ROS_SECURITY_KEYSTORE is not set: \
         set it to the folder made by `ros2 security create_keystore FOLDER`"
    )]
    NoKeystore,
    /// The keystore is not there.
    #[error(
        "ROS_SECURITY_KEYSTORE={}: there is no such folder; make it with \
         `ros2 security create_keystore {0}`", .keystore.display()
    )]
    KeystoreMissing {
        /// The folder.
        keystore: PathBuf,
    },
    /// A name that is no enclave.
    #[error("enclave '{name}': a path from the root of the keystore is wanted, such as /robot/eye")]
    Name {
        /// The name.
        name: String,
    },
    /// The enclave is not in the keystore.
    #[error(
        "enclave '{name}': there is no folder {}; make it with `ros2 security create_enclave {} {name}`, \
         or name another one with --ros-args --enclave or ROS_SECURITY_ENCLAVE_OVERRIDE",
        .folder.display(), .keystore.display()
    )]
    EnclaveMissing {
        /// The enclave.
        name: String,
        /// The keystore.
        keystore: PathBuf,
        /// Where the enclave should be.
        folder: PathBuf,
    },
    /// The enclave is not complete.
    #[error(
        "{} cannot be read ({reason}); an enclave holds {}; make it anew with `ros2 security create_enclave`",
        .file.display(), FILES.join(", ")
    )]
    File {
        /// The file.
        file: PathBuf,
        /// Why.
        reason: String,
    },
    /// A list of revoked certificates, which would not be looked at.
    #[error(
        "{}: revoked certificates are not recognised by this node, so a participant with one would be \
         let in; take the file away if that is acceptable, or sign the others' certificates with a new CA",
        .file.display()
    )]
    Revocations {
        /// The file.
        file: PathBuf,
    },
}

/// An enclave whose files are all there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Enclave {
    folder: PathBuf,
}

impl Enclave {
    /// The enclave in this folder.
    ///
    /// # Errors
    /// When a file is missing, and in a build that could not use them.
    pub fn open(folder: impl Into<PathBuf>) -> Result<Self, SecurityError> {
        if !cfg!(feature = "security") {
            return Err(SecurityError::NotBuilt);
        }
        let folder = folder.into();
        for name in FILES {
            let file = folder.join(name);
            if let Err(error) = std::fs::File::open(&file) {
                return Err(SecurityError::File { file, reason: error.to_string() });
            }
        }
        Ok(Self { folder })
    }

    /// Where the files are.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What governance asks for that `RustDDS` does in a way of its own.
    fn remark(&self) -> Option<String> {
        let file = self.folder.join("governance.p7s");
        // The document is signed, not encrypted, so it can be read as text.
        let text = std::fs::read_to_string(&file).ok()?;
        payloads_are_protected(&text).then(|| {
            format!(
                "{}: data_protection_kind is not NONE: messages whose length is no multiple of four \
                 (camera infos among them) will not be understood. Set it to NONE in governance.xml, \
                 keep metadata_protection_kind ENCRYPT, which encrypts the same bytes, and sign it anew",
                file.display()
            )
        })
    }

    /// A file that says which certificates are revoked, when there is one.
    fn revocations(&self) -> Option<PathBuf> {
        let file = self.folder.join(REVOCATIONS);
        file.exists().then_some(file)
    }
}

/// True when a topic rule of a governance document protects the payload by
/// itself, beside the submessage that carries it.
fn payloads_are_protected(governance: &str) -> bool {
    let mut values = governance.split("<data_protection_kind>").skip(1);
    values.any(|rest| rest.split('<').next().is_some_and(|value| value.trim() != "NONE"))
}

/// What the variables of a process ask for.
#[derive(Clone, Debug)]
pub(super) struct Demand {
    /// Better none than unsecured.
    pub enforce: bool,
    /// `ROS_SECURITY_KEYSTORE`
    pub keystore: Option<String>,
    /// `ROS_SECURITY_ENCLAVE_OVERRIDE`, else `--enclave`.
    pub enclave: Option<String>,
}

impl Demand {
    /// The enclave, or `None` and a note why traffic is not secured.
    ///
    /// # Errors
    /// When security is enforced and cannot be had.
    pub fn meet(&self, notes: &mut Vec<String>) -> Result<Option<Enclave>, SecurityError> {
        match self.find() {
            Ok(enclave) => {
                if let Some(file) = enclave.revocations() {
                    let error = SecurityError::Revocations { file };
                    if self.enforce {
                        return Err(error);
                    }
                    notes.push(error.to_string());
                }
                notes.extend(enclave.remark());
                Ok(Some(enclave))
            }
            Err(error) if self.enforce => Err(error),
            Err(error) => {
                notes.push(format!(
                    "traffic is NOT secured (ROS_SECURITY_STRATEGY is not Enforce): {error}"
                ));
                Ok(None)
            }
        }
    }

    fn find(&self) -> Result<Enclave, SecurityError> {
        if !cfg!(feature = "security") {
            return Err(SecurityError::NotBuilt);
        }
        let keystore = PathBuf::from(self.keystore.as_ref().ok_or(SecurityError::NoKeystore)?);
        if !keystore.is_dir() {
            return Err(SecurityError::KeystoreMissing { keystore });
        }
        let name = self.enclave.as_deref().unwrap_or(ROOT_ENCLAVE);
        let inside = Path::new(name.trim_start_matches('/'));
        if !inside.components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(SecurityError::Name { name: name.to_owned() });
        }
        let folder = keystore.join("enclaves").join(inside);
        if !folder.is_dir() {
            return Err(SecurityError::EnclaveMissing { name: name.to_owned(), keystore, folder });
        }
        Enclave::open(folder)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn demand(enforce: bool, keystore: &Path, enclave: &str) -> Demand {
        Demand {
            enforce,
            keystore: Some(keystore.display().to_string()),
            enclave: Some(enclave.to_owned()),
        }
    }

    #[cfg(not(feature = "security"))]
    #[test]
    fn a_build_without_security_says_so() {
        let here = Path::new(".");
        let mut notes = Vec::new();
        assert_eq!(demand(true, here, "/").meet(&mut notes), Err(SecurityError::NotBuilt));
        assert_eq!(demand(false, here, "/").meet(&mut notes), Ok(None));
        assert!(notes[0].contains("NOT secured") && notes[0].contains("--features security"));
        assert_eq!(Enclave::open("."), Err(SecurityError::NotBuilt));
    }

    #[cfg(feature = "security")]
    #[test]
    fn an_enclave_is_found_under_its_keystore() {
        let keystore = tempfile::tempdir().unwrap();
        let folder = keystore.path().join("enclaves/robot/eye");
        std::fs::create_dir_all(&folder).unwrap();
        for name in FILES {
            std::fs::write(folder.join(name), "").unwrap();
        }
        let mut notes = Vec::new();
        for name in ["/robot/eye", "robot/eye"] {
            let enclave = demand(true, keystore.path(), name).meet(&mut notes).unwrap().unwrap();
            assert_eq!(enclave.folder(), folder);
        }
        assert!(notes.is_empty());
        std::fs::write(folder.join(REVOCATIONS), "").unwrap();
        let refused = demand(true, keystore.path(), "/robot/eye").meet(&mut notes).unwrap_err();
        assert!(refused.to_string().contains("crl.pem"), "{refused}");
        assert!(demand(false, keystore.path(), "/robot/eye").meet(&mut notes).unwrap().is_some());
        assert_eq!(notes.len(), 1);
    }

    #[test]
    fn protected_payloads_are_found() {
        let rule = |kind| format!("<data_protection_kind>{kind}</data_protection_kind>");
        assert!(!payloads_are_protected(&rule("NONE")));
        assert!(!payloads_are_protected(""));
        assert!(payloads_are_protected(&(rule(" NONE\n") + &rule("ENCRYPT"))));
        assert!(payloads_are_protected(&rule("SIGN")));
    }

    #[cfg(feature = "security")]
    #[test]
    fn what_is_missing_is_named_with_its_path() {
        let keystore = tempfile::tempdir().unwrap();
        let folder = keystore.path().join("enclaves/eye");
        std::fs::create_dir_all(&folder).unwrap();
        let nowhere = keystore.path().join("nowhere");
        let file = folder.join(FILES[0]).display().to_string();
        let other = keystore.path().join("enclaves/other").display().to_string();
        let none = Demand { enforce: true, keystore: None, enclave: None };
        for (demand, named) in [
            (none, "ROS_SECURITY_KEYSTORE"),
            (demand(true, &nowhere, "/eye"), nowhere.to_str().unwrap()),
            (demand(true, keystore.path(), "/other"), &other),
            (demand(true, keystore.path(), "/../eye"), "/../eye"),
            (demand(true, keystore.path(), "/eye"), &file),
        ] {
            let mut notes = Vec::new();
            let text = demand.meet(&mut notes).unwrap_err().to_string();
            assert!(text.contains(named), "{text}");
            assert!(notes.is_empty());
            // Without enforcement the node goes on, and says the same.
            let lenient = Demand { enforce: false, ..demand };
            assert_eq!(lenient.meet(&mut notes), Ok(None));
            assert!(notes[0].contains(&text) && notes[0].contains("NOT secured"), "{notes:?}");
        }
    }
}
