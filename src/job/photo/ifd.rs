//! Directories of classic TIFF, which is also the inside of EXIF: read, and changed in place.

/// Type of a 16-bit value.
pub(super) const SHORT: u16 = 3;

/// Order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

impl Order {
    /// By the header; `None` where this is no classic TIFF.
    pub(super) fn of(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [b'I', b'I', 42, 0, ..] => Some(Self::Little),
            [b'M', b'M', 0, 42, ..] => Some(Self::Big),
            _ => None,
        }
    }

    pub(super) const fn u16(self, b: [u8; 2]) -> u16 {
        match self {
            Self::Little => u16::from_le_bytes(b),
            Self::Big => u16::from_be_bytes(b),
        }
    }

    const fn u32(self, b: [u8; 4]) -> u32 {
        match self {
            Self::Little => u32::from_le_bytes(b),
            Self::Big => u32::from_be_bytes(b),
        }
    }

    fn u16_at(self, bytes: &[u8], at: usize) -> Option<u16> {
        Some(self.u16(bytes.get(at..at.checked_add(2)?)?.try_into().ok()?))
    }

    fn u32_at(self, bytes: &[u8], at: usize) -> Option<u32> {
        Some(self.u32(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?))
    }
}

/// One tag of a directory.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) tag: u16,
    pub(super) kind: u16,
    pub(super) count: usize,
    /// Where the value field is.
    pub(super) value_at: usize,
    /// The value where it is one SHORT or LONG, else the offset of the values.
    pub(super) value: u32,
}

impl Entry {
    /// Overwrites the value of a single SHORT or LONG; `None` where the value does not fit or lies outside.
    pub(super) fn set(&self, bytes: &mut [u8], value: u32) -> Option<()> {
        let order = Order::of(bytes)?;
        let field = bytes.get_mut(self.value_at..self.value_at.checked_add(4)?)?;
        match (self.kind, order) {
            (SHORT, Order::Little) => field[..2].copy_from_slice(&u16::try_from(value).ok()?.to_le_bytes()),
            (SHORT, Order::Big) => field[..2].copy_from_slice(&u16::try_from(value).ok()?.to_be_bytes()),
            (_, Order::Little) => field.copy_from_slice(&value.to_le_bytes()),
            (_, Order::Big) => field.copy_from_slice(&value.to_be_bytes()),
        }
        Some(())
    }
}

/// A directory.
#[derive(Clone, Debug)]
pub(super) struct Directory {
    pub(super) entries: Vec<Entry>,
    /// Where the offset of the next directory stands.
    pub(super) next_at: usize,
    /// That offset, 0 for none.
    pub(super) next: u32,
}

impl Directory {
    /// The directory at an offset; `None` where it reaches outside.
    pub(super) fn at(bytes: &[u8], start: usize) -> Option<Self> {
        let order = Order::of(bytes)?;
        let count = usize::from(order.u16_at(bytes, start)?);
        let entries = (0..count)
            .map(|i| {
                let at = start.checked_add(2 + 12 * i)?;
                let (kind, count) = (order.u16_at(bytes, at + 2)?, order.u32_at(bytes, at + 4)? as usize);
                let value = if kind == SHORT && count == 1 {
                    u32::from(order.u16_at(bytes, at + 8)?)
                } else {
                    order.u32_at(bytes, at + 8)?
                };
                Some(Entry { tag: order.u16_at(bytes, at)?, kind, count, value_at: at + 8, value })
            })
            .collect::<Option<_>>()?;
        let next_at = start.checked_add(2 + 12 * count)?;
        Some(Self { entries, next_at, next: order.u32_at(bytes, next_at).unwrap_or(0) })
    }

    /// The first directory of a file or an EXIF block.
    pub(super) fn first(bytes: &[u8]) -> Option<Self> {
        Self::at(bytes, Order::of(bytes)?.u32_at(bytes, 4)? as usize)
    }

    pub(super) fn find(&self, tag: u16) -> Option<Entry> {
        self.entries.iter().find(|e| e.tag == tag).copied()
    }
}

/// A tag of the first directory.
pub(super) fn first(bytes: &[u8], tag: u16) -> Option<Entry> {
    Directory::first(bytes)?.find(tag)
}

/// Where the value fields of tags are: tests change them.
#[cfg(test)]
pub(super) fn value_positions(bytes: &[u8], tags: &[u16]) -> Option<Vec<usize>> {
    tags.iter().map(|tag| first(bytes, *tag).map(|e| e.value_at)).collect()
}
