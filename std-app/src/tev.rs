//! Pictures in the viewer tev, by its protocol over TCP.

use crate::save::Image;
use core::time::Duration;
use std::io;
use std::net::{TcpStream, ToSocketAddrs};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

/// Longest wait for a viewer.
const WAIT: Duration = Duration::from_secs(2);

/// Name of the picture in the viewer.
const NAME: &str = "halflight";

/// A connection to the viewer.
pub struct Viewer {
    client: TevClient,
    /// Size of the picture that the viewer has.
    size: Option<[u32; 2]>,
}

impl Viewer {
    /// Connects to the viewer at `HOST:PORT`.
    ///
    /// # Errors
    /// No viewer answers at this address within two seconds.
    pub fn connect(address: &str) -> io::Result<Self> {
        let unknown = || io::Error::other("it is no address");
        let address = address.to_socket_addrs()?.next().ok_or_else(unknown)?;
        let stream = TcpStream::connect_timeout(&address, WAIT)?;
        stream.set_write_timeout(Some(WAIT))?;
        Ok(Self { client: TevClient::wrap(stream), size: None })
    }

    /// Shows a picture in place of the last one.
    ///
    /// # Errors
    /// The viewer has gone, or takes no bytes for two seconds.
    pub fn show(&mut self, image: &Image) -> io::Result<()> {
        let Image { width, height, ref pixels } = *image;
        let channel_names = &["R", "G", "B"];
        if self.size.replace([width, height]) != Some([width, height]) {
            self.client.send(PacketCreateImage {
                image_name: NAME,
                grab_focus: true,
                width,
                height,
                channel_names,
            })?;
        }
        self.client.send(PacketUpdateImage {
            image_name: NAME,
            grab_focus: false,
            channel_names,
            channel_offsets: &[0, 1, 2],
            channel_strides: &[3, 3, 3],
            x: 0,
            y: 0,
            width,
            height,
            data: bytemuck::cast_slice(pixels),
        })
    }
}
