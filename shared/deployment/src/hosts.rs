//! `[[host]]` and section `[link]` of a deployment file: the machine that each view runs on, and the data sent between machines.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::capture::Mode;
use crate::complaint::{Complaint, demand, whole};
use crate::{Deployment, Views};

/// A machine of the deployment.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Host {
    /// Name of the host, for `--host` and reports; without `--host`, a machine runs as the host that has the machine's own name.
    pub name: String,
    /// Names of the cameras that are connected to the host.
    #[serde(default)]
    pub views: Vec<String>,
    /// Fuse the views on this host; exactly one host does so.
    #[serde(default)]
    pub fuses: bool,
    /// Address on which the fusing host listens, such as `"192.168.1.5:7447"`, or a name with a port.
    pub address: Option<String>,
}

/// Data sent from a host with cameras to the fusing host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Carry {
    /// Frames at search size, as JPEG; the fusing host finds the poses.
    #[default]
    Frames,
    /// Poses of single views. With a network, the maxima of its maps are sent too, and the views are solved in space as on a single
    /// machine. Views of the paper's method are not solved together in space; they are only triangulated.
    Poses,
}

/// The connection between hosts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Link {
    /// Data sent to the fusing host: `frames` as JPEG, or `poses` found at the camera, which need less bandwidth.
    pub carry: Carry,
    /// Quality of the JPEG images, 1 to 100.
    pub jpeg_quality: u8,
    /// Folder with `ca.pem`, and with `HOST.pem` and `HOST.key` of this host, as written by `parallax hosts keys`.
    pub keys: Option<PathBuf>,
    /// Connect without keys; anyone on the network can then read the pictures and send false ones.
    pub insecure: bool,
}

impl Default for Link {
    fn default() -> Self {
        Self {
            carry: Carry::Frames,
            jpeg_quality: 90,
            keys: None,
            insecure: false,
        }
    }
}

impl Link {
    /// Resolves relative paths against `base`.
    pub(crate) fn resolve(&mut self, base: &Path) {
        if let Some(keys) = &mut self.keys {
            *keys = base.join(&keys);
        }
    }
}

impl Deployment {
    /// Returns the host with a given name.
    pub fn host(&self, name: &str) -> Option<&Host> {
        self.hosts.iter().find(|host| host.name == name)
    }

    /// Returns the host that fuses the views.
    pub fn fusing_host(&self) -> Option<&Host> {
        self.hosts.iter().find(|host| host.fuses)
    }

    /// Returns the views of a host in ascending order.
    pub fn views_of(&self, host: &Host) -> Vec<usize> {
        let cameras = self.cameras.iter().enumerate();
        let own = cameras.filter(|(_, camera)| host.views.contains(&camera.name));
        own.map(|camera| camera.0).collect()
    }

    /// Returns true if hosts send the maps of networks, as Gaussians, together with the poses.
    pub fn maps_cross(&self) -> bool {
        self.link.carry == Carry::Poses && self.has_maps()
    }

    /// Returns the name of the part of a deployment that runs on a host. Its processes share memory under this name.
    pub fn name_on(&self, host: &Host) -> String {
        format!("{}.{}", self.name, host.name)
    }
}

/// Checks the hosts of a deployment. Without hosts, checks only the numbers of the link.
pub(crate) fn check(it: &Deployment) -> Result<(), Complaint> {
    whole("link.jpeg_quality", it.link.jpeg_quality)?;
    if it.hosts.is_empty() {
        return Ok(());
    }
    demand(
        it.hosts.len() >= 2,
        "host",
        "given once",
        "at least two [[host]] tables; with a single machine, leave out [[host]]",
    )?;
    names(it)?;
    views(it)?;
    let fusing: Vec<&Host> = it.hosts.iter().filter(|host| host.fuses).collect();
    demand(
        fusing.len() == 1,
        "host.fuses",
        &format!("true for {} hosts", fusing.len()),
        "true for exactly one host, where the results are written",
    )?;
    for host in &it.hosts {
        address(host)?;
    }
    real_time(it)?;
    keys(it)
}

fn names(it: &Deployment) -> Result<(), Complaint> {
    let good =
        |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '-';
    for (index, host) in it.hosts.iter().enumerate() {
        let name = &host.name;
        demand(
            !name.is_empty() && name.chars().all(good),
            "host.name",
            &format!("{name:?}"),
            "a name of lower-case letters, digits and hyphens",
        )?;
        let whole = it.name_on(host);
        demand(
            whole.len() <= 32,
            "host.name",
            &format!("{name:?}, or {whole:?} together with the name of the deployment"),
            "at most 32 characters for both names together",
        )?;
        demand(
            it.hosts[..index].iter().all(|other| other.name != *name),
            "host.name",
            &format!("twice {name:?}"),
            "a different name for each host",
        )?;
    }
    Ok(())
}

/// Checks that every view is on exactly one host.
fn views(it: &Deployment) -> Result<(), Complaint> {
    for host in &it.hosts {
        for view in &host.views {
            demand(
                it.cameras.iter().any(|camera| camera.name == *view),
                "host.views",
                &format!("{view:?} of host {:?}", host.name),
                "the name of a [[camera]]",
            )?;
        }
        demand(
            host.fuses || !host.views.is_empty(),
            "host.views",
            &format!("empty for {:?}", host.name),
            "at least one camera on each host that does not fuse",
        )?;
    }
    for camera in &it.cameras {
        let all = it.hosts.iter().flat_map(|host| &host.views);
        let n = all.filter(|view| **view == camera.name).count();
        demand(
            n == 1,
            "host.views",
            &format!("{:?} in {n} places", camera.name),
            "each camera on exactly one host",
        )?;
    }
    Ok(())
}

/// Checks the address on which the fusing host listens: a name or number, and a port.
fn address(host: &Host) -> Result<(), Complaint> {
    let Some(address) = &host.address else {
        return demand(
            !host.fuses,
            "host.address",
            &format!("missing for host {:?}, which fuses", host.name),
            "the address on which this host listens, such as \"192.168.1.5:7447\"",
        );
    };
    let parts = address.rsplit_once(':');
    let is_good = parts.is_some_and(|(name, port)| {
        let of_name = |letter: char| letter.is_ascii_alphanumeric() || "-._:[]".contains(letter);
        let port: Option<u16> = port.parse().ok();
        !name.is_empty() && name.chars().all(of_name) && port.is_some_and(|port| port > 0)
    });
    demand(
        is_good,
        "host.address",
        &format!("{address:?}"),
        "a host name or IP address, a colon and a port, such as \"192.168.1.5:7447\"",
    )
}

/// Checks that the mode is real time, because hosts do not wait for each other.
fn real_time(it: &Deployment) -> Result<(), Complaint> {
    demand(
        it.capture.mode == Mode::Realtime,
        "capture.mode",
        "not \"realtime\"",
        "\"realtime\" for a deployment with hosts, because frames of several machines are matched by their times",
    )?;
    demand(
        it.capture.frame_rate_hz.is_some(),
        "capture.frame_rate_hz",
        "left out",
        "the frame rate of all cameras, which a deployment with hosts needs",
    )?;
    let has_clocks = it.cameras.iter().any(|camera| camera.offset_ms.is_some());
    demand(
        !has_clocks,
        "camera.offset_ms",
        "given in a deployment with hosts",
        "no offset, because the clocks of hosts are compared during the run",
    )?;
    demand(
        it.link.carry == Carry::Frames || it.views() != Views::All,
        "link.carry",
        "\"poses\" although `paper.views` is \"all\"",
        "\"frames\" (or set `method = \"network\"` or `paper.views = \"pairs\"`), because hosts do not send the filter responses from \
         which all views are solved at once",
    )
}

fn keys(it: &Deployment) -> Result<(), Complaint> {
    demand(
        it.link.insecure || it.link.keys.is_some(),
        "link.keys",
        "left out",
        "the folder that `parallax hosts keys` makes; or set link.insecure = true, which lets anyone on the network see the pictures",
    )?;
    demand(
        !(it.link.insecure && it.link.keys.is_some()),
        "link.insecure",
        "true although link.keys is given",
        "only one of link.keys and link.insecure",
    )
}

#[cfg(test)]
mod tests;
