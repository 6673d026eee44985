#include "packets_code.h"

namespace ob {
extern const PacketCode kAvx512Packets;
const PacketCode kAvx512Packets = kCode;
} // namespace ob
