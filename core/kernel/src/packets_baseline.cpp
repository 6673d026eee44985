#include "packets_code.h"

namespace ob {
extern const PacketCode kBaselinePackets;
const PacketCode kBaselinePackets = kCode;
} // namespace ob
