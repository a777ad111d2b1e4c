from setuptools import find_packages, setup

package = 'maglev_reference'

setup(
    name=package,
    version='0.1.0',
    packages=find_packages(),
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{package}']),
        (f'share/{package}', ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='Maglev stage maintainers',
    maintainer_email='maintainers@maglev-stage.org',
    description='Reference trajectories of the maglev stage, and their node',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'match = maglev_reference.match:main',
            'reference = maglev_reference.node:main',
        ]
    },
)
