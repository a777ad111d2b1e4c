from setuptools import find_packages, setup

package = 'maglev_node'

setup(
    name=package,
    version='0.1.0',
    packages=find_packages(),
    package_data={package: ['fastdds.xml']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='Maglev stage maintainers',
    maintainer_email='maintainers@maglev-stage.org',
    description='What every node of the maglev stage stands on',
    license='Apache-2.0',
    entry_points={'console_scripts': []},
)
