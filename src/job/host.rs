//! The process and host of a worker, for messages.

use serde::{Deserialize, Serialize};
use std::fmt::{Display, Formatter};

/// A process on a host.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub(super) struct Host {
    name: String,
    process: u32,
}

impl Host {
    /// This process.
    pub fn this() -> Self {
        let of_system = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
        let of_shell = || ["HOSTNAME", "COMPUTERNAME"].into_iter().find_map(|name| std::env::var(name).ok());
        let of_command = || String::from_utf8(std::process::Command::new("hostname").output().ok()?.stdout).ok();
        let name = of_system.or_else(of_shell).or_else(of_command).unwrap_or_else(|| "a host without a name".into());
        Self { name: name.trim().to_owned(), process: std::process::id() }
    }
}

impl Display for Host {
    fn fmt(&self, out: &mut Formatter<'_>) -> std::fmt::Result {
        write!(out, "{}, process {}", self.name, self.process)
    }
}
