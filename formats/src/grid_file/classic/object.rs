use std::collections::VecDeque;

use super::bytes::{Bytes, Fields};
use crate::grid_file::Fault;

const CONTINUATION: u16 = 0x10;
const SHARED: u8 = 2;

/// A header of ours has less than 4 KiB, one with every text at its longest still a few. It bounds what a header may
/// make us hold, and stops one that continues in itself.
const MAX_HEADER_BYTES: usize = 1 << 20;
const MAX_HEADER_BLOCKS: usize = 64;

/// The header of a group or dataset: section IV.A.1.a.
pub(in crate::grid_file) struct Object {
    messages: Vec<Message>,
}

struct Message {
    kind: u16,
    body: Vec<u8>,
}

impl Object {
    pub(super) fn read(bytes: &mut Bytes, address: u64) -> Result<Self, Fault> {
        let prefix = bytes.at(address, 16)?;
        let mut fields = Fields(&prefix);
        let version = fields.u8()?;
        if version != 1 {
            return Err(Fault::not_a_grid(format!("an object header has version {version}, a grid's has 1")));
        }
        fields.skip(1)?;
        let count = fields.u16()? as usize;
        fields.skip(4)?;
        let mut blocks = VecDeque::from([(address + 16, u64::from(fields.u32()?))]);
        let mut messages = Vec::new();
        let [mut blocks_seen, mut bytes_seen] = [0, 0];
        while let Some((address, length)) = blocks.pop_front() {
            let length = usize::try_from(length).unwrap_or(usize::MAX);
            blocks_seen += 1;
            bytes_seen = length.saturating_add(bytes_seen);
            if blocks_seen > MAX_HEADER_BLOCKS || bytes_seen > MAX_HEADER_BYTES {
                return Err(Fault::damaged("an object header is out of all proportion"));
            }
            let block = bytes.at(address, length)?;
            let mut fields = Fields(&block);
            while fields.0.len() >= 8 && messages.len() < count {
                let kind = fields.u16()?;
                let size = fields.u16()? as usize;
                let flags = fields.u8()?;
                fields.skip(3)?;
                let mut body = fields.take(size)?;
                if kind == CONTINUATION {
                    let mut fields = Fields(body);
                    blocks.push_back((fields.u64()?, fields.u64()?));
                }
                if flags & SHARED != 0 {
                    // Its body lies elsewhere; empty, it is refused by whoever needs it.
                    body = &[];
                }
                messages.push(Message { kind, body: body.to_vec() });
            }
        }
        Ok(Self { messages })
    }

    /// The bodies of all messages of a kind.
    pub(super) fn all(&self, kind: u16) -> impl Iterator<Item = &[u8]> {
        self.messages.iter().filter(move |message| message.kind == kind).map(|message| message.body.as_slice())
    }

    /// The body of the only message of a kind.
    pub(super) fn only(&self, kind: u16) -> Option<&[u8]> {
        let mut all = self.all(kind);
        all.next().filter(|_| all.next().is_none())
    }
}
