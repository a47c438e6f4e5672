//! A keystore as `ros2 security` makes it, by the command `openssl`: one CA for
//! identities and permissions, and a folder per enclave.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A keystore for one domain, gone with its value.
pub struct Keystore {
    folder: tempfile::TempDir,
    domain_id: u16,
}

impl Keystore {
    /// A keystore with a CA and a governance that protects everything.
    pub fn new(domain_id: u16) -> Self {
        let keystore = Self { folder: tempfile::tempdir().unwrap(), domain_id };
        let made = keystore.path();
        for name in ["public", "private", "enclaves"] {
            fs::create_dir(made.join(name)).unwrap();
        }
        keystore.openssl(
            "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 30 \
             -subj /CN=sros2CA -keyout private/ca.key.pem -out public/ca.cert.pem",
        );
        fs::write(made.join("enclaves/governance.xml"), governance(domain_id)).unwrap();
        keystore.sign("enclaves/governance.xml", "enclaves/governance.p7s");
        keystore
    }

    /// The folder that `ROS_SECURITY_KEYSTORE` names.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Identity and permissions for every topic of ROS.
    pub fn add_enclave(&self, name: &str) {
        let inside = format!("enclaves{name}");
        let folder = self.path().join(&inside);
        fs::create_dir_all(&folder).unwrap();
        // A slash begins the next part of a subject unless it is escaped.
        let subject = name.replace('/', "\\/");
        self.openssl(&format!(
            "req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -subj /CN={subject} \
             -keyout {inside}/key.pem -out {inside}/request.pem"
        ));
        self.openssl(&format!(
            "x509 -req -days 30 -in {inside}/request.pem -CA public/ca.cert.pem \
             -CAkey private/ca.key.pem -CAcreateserial -out {inside}/cert.pem"
        ));
        fs::write(folder.join("permissions.xml"), permissions(name, self.domain_id)).unwrap();
        self.sign(&format!("{inside}/permissions.xml"), &format!("{inside}/permissions.p7s"));
        for (from, to) in [
            ("public/ca.cert.pem", "identity_ca.cert.pem"),
            ("public/ca.cert.pem", "permissions_ca.cert.pem"),
            ("enclaves/governance.p7s", "governance.p7s"),
        ] {
            fs::copy(self.path().join(from), folder.join(to)).unwrap();
        }
    }

    fn sign(&self, from: &str, to: &str) {
        self.openssl(&format!(
            "smime -sign -text -in {from} -out {to} -signer public/ca.cert.pem -inkey private/ca.key.pem"
        ));
    }

    fn openssl(&self, arguments: &str) {
        let output = Command::new("openssl")
            .args(arguments.split_whitespace())
            .current_dir(PathBuf::from(self.path()))
            .output()
            .expect("the command openssl is wanted");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "openssl {arguments}: {said}");
    }
}

/// As `ros2 security create_keystore` writes it, but for `data_protection_kind`.
fn governance(domain_id: u16) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">
  <domain_access_rules>
    <domain_rule>
      <domains><id>{domain_id}</id></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>SIGN</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>NONE</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
"#
    )
}

/// As `ros2 security create_enclave` writes it.
fn permissions(name: &str, domain_id: u16) -> String {
    let topics = "<topics><topic>rq/*Request</topic><topic>rr/*Reply</topic><topic>rt/*</topic>\
                  <topic>ros_discovery_info</topic></topics>";
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name="{name}">
      <subject_name>CN={name}</subject_name>
      <validity>
        <not_before>2020-01-01T00:00:00</not_before>
        <not_after>2120-01-01T00:00:00</not_after>
      </validity>
      <allow_rule>
        <domains><id>{domain_id}</id></domains>
        <publish>{topics}</publish>
        <subscribe>{topics}</subscribe>
      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
"#
    )
}
