!! Bearings between a node of a shaft and the frame or another node: matrices of rolling elements, or as given.
!!
!! A rolling element at the angle delta from y towards z pushes along t = (0, cos delta, sin delta, 0, -xi sin delta,
!! xi cos delta), xi being the distance of the row from the node along x, and along the axis at radius r by
!! t_ax = (1, 0, 0, 0, r sin delta, -r cos delta) (source thesis, (4.62)-(4.65)):
!!
!!     K = sum k t tᵀ + k_ax t_ax t_axᵀ,   B = beta K.
!!
!! All elements are taken to carry; three or more give N k/2 in every radial direction.
!!
!! Given matrices need not be symmetric: those of oil films and seals are not. The skew part of the stiffness, the cross
!! coupling (k_yz - k_zy)/2, has no potential and drives whirl; it is kept apart from the symmetric part, and so is that of damping.
!! Those of a table change with the speed of the shaft.
module razy_rotor_bearing
   use razy_core_angle, only: turn
   use razy_core_kinds, only: wp
   use razy_linalg_dense, only: add_outer
   use razy_linalg_speed_table, only: of_damping, of_stiffness, speed_table_t
   implicit none(type, external)
   private

   public :: bearing_t, rolling_row_t, given_bearing, rolling_bearing, tabled_bearing
   public :: joined, radial_direction, table_columns

   !> Columns of a table, in N/m and N s/m: rows of the 2 x 2 matrices of stiffness and damping.
   character(*), parameter :: table_columns(8) = ["kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"]

   !> A bearing on a node and, unless that is the frame (0), one that moves against it, its matrices in (u, v, w, phi, theta,
   !> psi): N/m (N m/rad, N/rad), N s/m. Symmetric parts, and the
   !> skew parts that are to be added to them; with a table these are those of its first speed.
   type :: bearing_t
      integer :: shaft = 0, node = 0, to_shaft = 0, to_node = 0
      real(wp) :: stiffness(6, 6) = 0.0_wp, damping(6, 6) = 0.0_wp
      real(wp) :: cross_stiffness(6, 6) = 0.0_wp, cross_damping(6, 6) = 0.0_wp
      !> The columns of `table_columns` on v (x) and w (y), over the speed of the shaft.
      type(speed_table_t), allocatable :: table
   contains
      procedure :: coefficients
   end type bearing_t

   !> A row of equal rolling elements.
   type :: rolling_row_t
      integer :: elements = 0
      !> Angle of the first element from y towards z, deg.
      real(wp) :: first_angle = 0.0_wp
      !> Radial and axial stiffness of each element, N/m.
      real(wp) :: radial = 0.0_wp, axial = 0.0_wp
      !> Distance of the row from the node along +x, radius at which axial forces act, m.
      real(wp) :: offset = 0.0_wp, axial_radius = 0.0_wp
      !> Damping over stiffness, s.
      real(wp) :: damping_factor = 0.0_wp
   end type rolling_row_t

contains

   !> The whole matrices (6, 6) of stiffness and damping at a speed of the shaft, rad/s.
   pure subroutine coefficients(self, speed, stiffness, damping)
      class(bearing_t), intent(in) :: self
      real(wp), intent(in) :: speed
      real(wp), intent(out) :: stiffness(6, 6), damping(6, 6)

      real(wp) :: values(size(table_columns))

      stiffness = self%stiffness + self%cross_stiffness
      damping = self%damping + self%cross_damping
      if (.not. allocated(self%table)) return
      values = self%table%at(abs(speed), 0)
      stiffness(2:3, 2:3) = reshape(values(of_stiffness), [2, 2], order=[2, 1])
      damping(2:3, 2:3) = reshape(values(of_damping), [2, 2], order=[2, 1])
   end subroutine coefficients

   !> A bearing with these matrices (6, 6), symmetric or not.
   pure function given_bearing(shaft, node, stiffness, damping) result(bearing)
      integer, intent(in) :: shaft, node
      real(wp), intent(in) :: stiffness(6, 6), damping(6, 6)
      type(bearing_t) :: bearing

      bearing%shaft = shaft
      bearing%node = node
      bearing%stiffness = 0.5_wp*(stiffness + transpose(stiffness))
      bearing%damping = 0.5_wp*(damping + transpose(damping))
      bearing%cross_stiffness = 0.5_wp*(stiffness - transpose(stiffness))
      bearing%cross_damping = 0.5_wp*(damping - transpose(damping))
   end function given_bearing

   !> A matrix (6, 6) of the motion of one node against another in the coordinates of both (12, 12).
   pure function joined(matrix) result(both)
      real(wp), intent(in) :: matrix(6, 6)
      real(wp) :: both(12, 12)

      both(:6, :6) = matrix
      both(7:, :6) = -matrix
      both(:6, 7:) = -matrix
      both(7:, 7:) = matrix
   end function joined

   !> A bearing with the matrices of a table on v and w.
   pure function tabled_bearing(shaft, node, table) result(bearing)
      integer, intent(in) :: shaft, node
      type(speed_table_t), intent(in) :: table
      type(bearing_t) :: bearing

      real(wp) :: damping(6, 6), stiffness(6, 6)

      bearing%table = table
      call bearing%coefficients(table%speed(1), stiffness, damping)
      bearing = given_bearing(shaft, node, stiffness, damping)
      bearing%table = table
   end function tabled_bearing

   !> The direction t (6) of a rolling element at the angle of `at`, whose row is at a distance from the node along +x, m.
   pure function radial_direction(at, offset) result(t)
      complex(wp), intent(in) :: at
      real(wp), intent(in) :: offset
      real(wp) :: t(6)

      t = [0.0_wp, at%re, at%im, 0.0_wp, -offset*at%im, offset*at%re]
   end function radial_direction

   !> A bearing of one row of rolling elements at equal angles.
   pure function rolling_bearing(shaft, node, row) result(bearing)
      integer, intent(in) :: shaft, node
      type(rolling_row_t), intent(in) :: row
      type(bearing_t) :: bearing

      complex(wp) :: at
      real(wp) :: k(6, 6), along(6)
      integer :: j

      k = 0.0_wp
      do j = 1, row%elements
         at = turn(row%first_angle + 360.0_wp*(j - 1)/row%elements)
         along = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, row%axial_radius*at%im, -row%axial_radius*at%re]
         call add_outer(k, row%radial, radial_direction(at, row%offset))
         call add_outer(k, row%axial, along)
      end do
      bearing = given_bearing(shaft, node, k, row%damping_factor*k)
   end function rolling_bearing

end module razy_rotor_bearing
