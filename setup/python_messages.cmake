# Included by the build of the messages where ROS comes from wheels. There are Python nodes there and
# nothing else, so the messages go without their C++ halves, which take longer to build than all the
# rest. Fast DDS needs their introspection to register types.
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
list(FILTER AMENT_EXTENSIONS_rosidl_generate_idl_interfaces EXCLUDE REGEX "_cpp:")
