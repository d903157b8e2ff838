//! Object headers of version 1: section IV.A.1.a.
//!
//! A header is a list of messages in one block, or in several that continuation messages chain. Bounds on blocks and
//! bytes stop a header that continues in itself.

use std::collections::VecDeque;

use super::ReadError;
use super::fields::Fields;
use super::source::ByteSource;

const CONTINUATION: u16 = 0x10;
const SHARED: u8 = 2;

/// Largest header, in bytes. Ours have less than 4 KiB, or a few times [`super::MAX_TEXT_BYTES`] with the longest
/// texts.
const MAX_HEADER_BYTES: usize = 1 << 20;
const MAX_HEADER_BLOCKS: usize = 64;

/// The header messages of a group or dataset.
pub(crate) struct Object {
    messages: Vec<Message>,
}

struct Message {
    kind: u16,
    body: Vec<u8>,
}

impl Object {
    pub(super) fn read(source: &ByteSource, address: u64) -> Result<Self, ReadError> {
        let prefix = source.read(address, 16)?;
        let mut fields = Fields(&prefix);
        let version = fields.u8()?;
        if version != 1 {
            return Err(ReadError::unexpected(format!("an object header has version {version}, a grid's has 1")));
        }
        fields.skip(1)?;
        let count = fields.u16()? as usize;
        fields.skip(4)?;
        let mut blocks = VecDeque::from([(address + 16, u64::from(fields.u32()?))]);
        let mut messages = Vec::new();
        let [mut block_count, mut byte_count] = [0, 0];
        while let Some((address, length)) = blocks.pop_front() {
            let length = usize::try_from(length).unwrap_or(usize::MAX);
            block_count += 1;
            byte_count = length.saturating_add(byte_count);
            if block_count > MAX_HEADER_BLOCKS || byte_count > MAX_HEADER_BYTES {
                return Err(ReadError::damaged("an object header is too large"));
            }
            let block = source.read(address, length)?;
            let mut fields = Fields(&block);
            while fields.0.len() >= 8 && messages.len() < count {
                let kind = fields.u16()?;
                let size = fields.u16()? as usize;
                let flags = fields.u8()?;
                fields.skip(3)?;
                let mut body = fields.bytes(size)?;
                if kind == CONTINUATION {
                    let mut fields = Fields(body);
                    blocks.push_back((fields.u64()?, fields.u64()?));
                }
                if flags & SHARED != 0 {
                    // The body lies elsewhere. Whoever needs the message refuses an empty one.
                    body = &[];
                }
                messages.push(Message { kind, body: body.to_vec() });
            }
        }
        Ok(Self { messages })
    }

    /// Bodies of all messages of a kind.
    pub(super) fn all(&self, kind: u16) -> impl Iterator<Item = &[u8]> {
        self.messages.iter().filter(move |message| message.kind == kind).map(|message| message.body.as_slice())
    }

    /// Body of the message of a kind, if there is exactly one.
    pub(super) fn only(&self, kind: u16) -> Option<&[u8]> {
        let mut all = self.all(kind);
        all.next().filter(|_| all.next().is_none())
    }
}
