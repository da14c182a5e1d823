// What of the library others can link to.
#pragma once

// Everything is compiled with hidden visibility (-fvisibility=hidden) but for what public headers declare:
// each opens the namespace with this. A shared library then exports its interface, and nothing else.
#define WEBOTS_CLOUD_API [[gnu::visibility("default")]]
