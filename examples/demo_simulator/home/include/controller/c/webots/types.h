#ifndef WEBOTS_TYPES_H
#define WEBOTS_TYPES_H

#ifdef __cplusplus
#define WEBOTS_C_BEGIN extern "C" {
#define WEBOTS_C_END }
#else
#define WEBOTS_C_BEGIN
#define WEBOTS_C_END
#endif

typedef unsigned short WbDeviceTag; /* of a device; 0: there is none */

#endif
