!! How far from 0 eigenvalues with positive real parts can be.
!!
!! With the forms m, b, g, k, c of M, B, G, K and the skew matrix of cross coupling and circulation in a shape, times their phase,
!! λ² m + λ (b + i g) + k + i c = 0. Divided by λ = μ + i w its real part is, with m > 0, b >= 0 and k >= 0,
!!
!!     -c w = |λ|² (b + μ m) + k μ,   so that   |λ| < |c|/b   where μ > 0.
!!
!! What b and c are sums of bounds the quotient of the sums: that of a shaft whose internal damping has no preferred direction is
!! its speed, that of a bearing follows from its matrices.
module razy_rotor_whirl_unstable
   use razy_core_kinds, only: wp
   use razy_linalg_eigen, only: symmetric_eigen
   use razy_rotor_bearing, only: bearing_t
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_rotor, only: damping_modal
   implicit none(type, external)
   private

   public :: unstable_radius

   !> Eigenvalues of the matrices of a bearing below this share of the largest entry are 0.
   real(wp), parameter :: rounding = 1.0e-12_wp

contains

   !> A radius beyond which no eigenvalue has a positive real part at any of the angular speeds `speed` of the system, rad/s each;
   !> `circulatory`: whether C acts. The largest number where nothing can be said: with negative stiffness or damping, compression
   !> or torque, with cross coupling without damping at its place, or where internal damping that acts in C has preferred
   !> directions.
   function unstable_radius(model, speed, circulatory) result(radius)
      type(rotor_model_t), intent(in) :: model
      real(wp), intent(in) :: speed(:)
      logical, intent(in) :: circulatory
      real(wp) :: radius

      integer :: i, k
      logical :: known

      radius = 0.0_wp
      known = all(model%mesh_stiffness >= 0.0_wp) .and. all(model%mesh_damping >= 0.0_wp)
      if (circulatory .and. any(model%rotor%shaft%damping_ratio > 0.0_wp)) then
         known = known .and. model%rotor%damping /= damping_modal .and. is_round(model)
         radius = maxval(abs(speed))*maxval(abs(model%rotor%shaft%speed_ratio))
      end if
      known = known .and. .not. any([(any(model%rotor%shaft(i)%section%axial_force < 0.0_wp .or. &
                                          abs(model%rotor%shaft(i)%section%torque) > 0.0_wp), i=1, size(model%rotor%shaft))])
      do i = 1, size(model%rotor%bearing)
         associate (bearing => model%rotor%bearing(i))
            associate (free => model%numbering%of(bearing%shaft, bearing%node) > 0, &
                       ratio => model%rotor%shaft(bearing%shaft)%speed_ratio)
               if (bearing%to_shaft > 0) then
                  ! Between two nodes what is symmetric, as it is here, is bounded in the same way, both held.
                  known = known .and. .not. any(abs(bearing%cross_stiffness) + abs(bearing%cross_damping) > 0.0_wp)
                  call add_bearing(bearing%stiffness, bearing%damping, bearing%cross_stiffness, spread(.true., 1, 6), radius, known)
                  cycle
               end if
               if (.not. allocated(bearing%table)) then
                  call add_bearing(bearing%stiffness, bearing%damping, bearing%cross_stiffness, free, radius, known)
                  cycle
               end if
               do k = 1, size(speed)
                  call add_table(bearing, abs(ratio*speed(k)), free(2:3), radius, known)
               end do
            end associate
         end associate
      end do
      if (.not. known) radius = huge(radius)
   end function unstable_radius

   !> Whether the two displacements across the axis of each node, and its two tilts, are both there or both held.
   pure logical function is_round(model)
      type(rotor_model_t), intent(in) :: model

      associate (at => model%numbering%at)
         is_round = all((at(2, :) == 0) .eqv. (at(3, :) == 0)) .and. all((at(5, :) == 0) .eqv. (at(6, :) == 0))
      end associate
   end function is_round

   subroutine add_table(bearing, speed, free, radius, known)
      type(bearing_t), intent(in) :: bearing
      real(wp), intent(in) :: speed
      logical, intent(in) :: free(2)
      real(wp), intent(inout) :: radius
      logical, intent(inout) :: known

      real(wp) :: damping(6, 6), stiffness(6, 6)

      call bearing%coefficients(speed, stiffness, damping)
      associate (k => stiffness(2:3, 2:3), b => damping(2:3, 2:3))
         call add_bearing(0.5_wp*(k + transpose(k)), 0.5_wp*(b + transpose(b)), 0.5_wp*(k - transpose(k)), free, radius, known)
      end associate
   end subroutine add_table

   !> `stiffness` and `damping` symmetric, `cross` skew, (n, n) each, coordinates that are not `free` held.
   subroutine add_bearing(stiffness, damping, cross, free, radius, known)
      real(wp), intent(in) :: stiffness(:, :), damping(:, :), cross(:, :)
      logical, intent(in) :: free(:)
      real(wp), intent(inout) :: radius
      logical, intent(inout) :: known

      real(wp), allocatable :: b(:), c(:, :), k(:), square(:), turn(:, :), within(:, :)
      integer, allocatable :: own(:)
      integer :: i, info

      own = pack([(i, i=1, size(free))], free)
      if (size(own) == 0) return
      within = stiffness(own, own)
      k = 0.0_wp*within(:, 1)
      call symmetric_eigen(within, k, info)
      known = known .and. info == 0 .and. all(k >= -rounding*maxval(abs(k)))
      turn = damping(own, own)
      b = k
      call symmetric_eigen(turn, b, info)
      associate (least => rounding*maxval(abs(b)))
         known = known .and. info == 0 .and. all(b >= -least)
         c = matmul(transpose(turn), matmul(cross(own, own), turn))
         do i = 1, size(own)
            if (b(i) > least) then
               c(i, :) = c(i, :)/sqrt(b(i))
               c(:, i) = c(:, i)/sqrt(b(i))
            else
               known = known .and. all(abs(c(i, :)) <= rounding*maxval(abs(cross)))
               c(i, :) = 0.0_wp
               c(:, i) = 0.0_wp
            end if
         end do
      end associate
      c = matmul(transpose(c), c)
      square = b
      call symmetric_eigen(c, square, info)
      known = known .and. info == 0
      radius = max(radius, sqrt(max(0.0_wp, maxval(square))))
   end subroutine add_bearing

end module razy_rotor_whirl_unstable
